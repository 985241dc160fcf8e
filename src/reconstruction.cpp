#include <pcl/surface/mrf/reconstruction.h>
