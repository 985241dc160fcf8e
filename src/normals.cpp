#include <pcl/surface/mrf/normals.h>
