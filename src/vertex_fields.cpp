#include <pcl/surface/mrf/vertex_fields.h>
