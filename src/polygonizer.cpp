#include <pcl/surface/mrf/polygonizer.h>
