// SPDX-License-Identifier: BSD-3-Clause
#include <pcl/surface/impl/mrf_reconstruction.hpp>

#include <pcl/impl/instantiate.hpp>
#include <pcl/point_types.h>

#ifndef PCL_NO_PRECOMPILE
PCL_INSTANTIATE(MRFReconstruction, PCL_XYZ_POINT_TYPES)
#endif
