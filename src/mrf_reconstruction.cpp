// SPDX-License-Identifier: BSD-3-Clause
#include <pcl/surface/impl/mrf_reconstruction.hpp>

#include <pcl/point_types.h>

PCL_INSTANTIATE_MRFReconstruction(pcl::PointXYZ) PCL_INSTANTIATE_MRFReconstruction(pcl::PointXYZI)
    PCL_INSTANTIATE_MRFReconstruction(pcl::PointXYZRGB) PCL_INSTANTIATE_MRFReconstruction(pcl::PointNormal)
        PCL_INSTANTIATE_MRFReconstruction(pcl::PointXYZINormal)
            PCL_INSTANTIATE_MRFReconstruction(pcl::PointXYZRGBNormal)
