#include "icm.h"

#include <pcl/surface/mrf/exceptions.h>

namespace pcl {
namespace mrf {
template <typename Real>
SolveReport solveIcm(const LinearSystem<Real>&, const SolverOptions&, double, std::vector<Real>&, Execution&)
{
  throw InvalidOption("icm");
}
template SolveReport solveIcm(const LinearSystem<float>&, const SolverOptions&, double, std::vector<float>&,
                              Execution&);
template SolveReport solveIcm(const LinearSystem<double>&, const SolverOptions&, double, std::vector<double>&,
                              Execution&);
} // namespace mrf
} // namespace pcl
