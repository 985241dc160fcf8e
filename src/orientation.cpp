#include <pcl/surface/mrf/orientation.h>
