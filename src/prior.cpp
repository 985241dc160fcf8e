#include <pcl/surface/mrf/prior.h>
