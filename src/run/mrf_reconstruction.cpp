// SPDX-License-Identifier: BSD-3-Clause
#define PCL_MRF_ONLY_TYPES_OF_PCL
#include <pcl/surface/impl/mrf_reconstruction.hpp>

#include <pcl/impl/instantiate.hpp>
#include <pcl/point_types.h>

#ifndef PCL_NO_PRECOMPILE
#ifdef PCL_ONLY_CORE_POINT_TYPES
PCL_INSTANTIATE(MRFReconstruction, (pcl::PointXYZ)(pcl::PointXYZI)(pcl::PointXYZRGB)(pcl::PointNormal)(
                                       pcl::PointXYZINormal)(pcl::PointXYZRGBNormal))
#else
PCL_INSTANTIATE(MRFReconstruction, PCL_XYZ_POINT_TYPES)
#endif
#endif
