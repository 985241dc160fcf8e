#include <pcl/surface/mrf/outliers.h>
