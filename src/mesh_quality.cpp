#include <pcl/surface/mrf/mesh_quality.h>
