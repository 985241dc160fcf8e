#include <pcl/surface/mrf/data_term.h>
