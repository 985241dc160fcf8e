#include <pcl/surface/mrf/remesher.h>
