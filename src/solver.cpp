#include <pcl/surface/mrf/solver.h>
