#include <pcl/surface/mrf/sampling_density.h>
