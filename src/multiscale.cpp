#include <pcl/surface/mrf/multiscale.h>
