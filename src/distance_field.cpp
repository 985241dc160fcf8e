#include <pcl/surface/mrf/distance_field.h>
