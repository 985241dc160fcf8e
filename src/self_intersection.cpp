#include <pcl/surface/mrf/self_intersection.h>
