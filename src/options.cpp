#include <pcl/surface/mrf/options.h>
