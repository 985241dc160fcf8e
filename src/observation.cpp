#include <pcl/surface/mrf/observation.h>
