#include <pcl/surface/mrf/trimming.h>
