// SPDX-License-Identifier: BSD-3-Clause
#include "solver/cholesky.h"

#include "base/uninitialized.h"
#include "field/prior.h"

#include <pcl/surface/mrf/exceptions.h>
#include <pcl/surface/mrf/report.h>

#include <Eigen/Cholesky>

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>

namespace pcl {
namespace mrf {
namespace {

/// Columns and rows of the dense blocks that the work is cut into.
constexpr std::int32_t panelColumns = 64, taskRows = 256;

/// Work between two chances to cancel, operations per thread: a fifth of a second on a slow processor.
constexpr double flopsPerPoll = 4e8;

using Block = Eigen::Map<Eigen::MatrixXd, Eigen::Unaligned, Eigen::OuterStride<>>;
using ConstBlock = Eigen::Map<const Eigen::MatrixXd, Eigen::Unaligned, Eigen::OuterStride<>>;

Coupling couplingOf(Prior prior, bool pointwise)
{
  return {order(prior), pointwise};
}

/// Columns of the factor that have the same rows below them.
struct Supernode {
  std::int32_t first = 0, columns = 0; ///< places of its own voxels in the order of elimination
  std::int32_t rows = 0;               ///< of its own voxels and those that they are coupled with by then
  std::int64_t rowsAt = 0, valuesAt = 0;
};

/// A supernode that still changes a later one.
struct Descendant {
  std::int32_t node;
  std::int32_t begin, end; ///< its rows that are columns of the later one
};

class Factor {
public:
  Factor(const GridSize& size, const Coupling& coupling);

  void assemble(const LinearSystem& system, Execution& execution);

  /// \throw SolverFailure if the matrix is not positive definite
  void factorize(Execution& execution);

  /// x = A⁻¹ x, by voxels.
  void solve(std::vector<double>& x, Execution& execution) const;

private:
  const std::int32_t* rowsOf(const Supernode& node) const { return rows_.data() + node.rowsAt; }

  /// A block of a supernode's columns.
  Block block(const Supernode& node, std::int32_t row, std::int32_t column, std::int32_t rows, std::int32_t columns)
  {
    const auto stride = static_cast<std::ptrdiff_t>(node.rows);
    return Block(values_.data() + node.valuesAt + row + stride * column, rows, columns, Eigen::OuterStride<>(stride));
  }
  /// Rows of a supernode, of all its columns; a const object, as Eigen's triangular views want it.
  const ConstBlock rowsFrom(const Supernode& node, std::int32_t row, std::int32_t rows) const
  {
    return ConstBlock(values_.data() + node.valuesAt + row, rows, node.columns, Eigen::OuterStride<>(node.rows));
  }

  /// The first of a supernode's rows, from `from` on, that is not before a place.
  std::int32_t lowerRow(const Supernode& node, std::int32_t from, std::int32_t place) const
  {
    const std::int32_t* rows = rowsOf(node);
    return static_cast<std::int32_t>(std::lower_bound(rows + from, rows + node.rows, place) - rows);
  }

  void factorize(const Supernode& node, const std::vector<Descendant>& descendants, Execution& execution);
  void update(const Supernode& node, const std::vector<Descendant>& descendants, std::int32_t column,
              std::int32_t columns, std::int32_t row, std::int32_t rows, std::vector<double>& product);

  GridSize size_;
  int reach_;
  std::vector<std::int32_t> placeOf_;                          ///< by voxels
  std::vector<std::int32_t> nodeOf_;                           ///< by places
  std::vector<Supernode> nodes_;                               ///< in the order of elimination
  std::vector<std::int32_t> rows_;                             ///< of all supernodes: places, ascending
  std::vector<double, UninitializedAllocator<double>> values_; ///< of all supernodes: rows × columns, by columns
  std::vector<std::int32_t> rowAt_;                            ///< by places: row of the supernode at work
};

Factor::Factor(const GridSize& size, const Coupling& coupling)
    : size_(size), reach_(coupling.steps), placeOf_(static_cast<std::size_t>(size.count())), nodeOf_(placeOf_.size()),
      rowAt_(placeOf_.size())
{
  std::int32_t place = 0;
  std::int64_t rows = 0, values = 0;
  dissect(size, coupling, [&](const Front& front) {
    Supernode node;
    node.first = place;
    const VoxelBox& own = front.own;
    for (int z = own.lower[2]; z < own.upper[2]; ++z)
      for (int y = own.lower[1]; y < own.upper[1]; ++y)
        for (int x = own.lower[0]; x < own.upper[0]; ++x) {
          nodeOf_[static_cast<std::size_t>(place)] = static_cast<std::int32_t>(nodes_.size());
          placeOf_[static_cast<std::size_t>(size.index(x, y, z))] = place++;
        }
    node.columns = place - node.first;
    node.rows = static_cast<std::int32_t>(node.columns + boundaryCount(front, size, coupling));
    node.rowsAt = rows;
    node.valuesAt = values;
    rows += node.rows;
    values += std::int64_t{node.rows} * node.columns;
    nodes_.push_back(node);
  });
  rows_.reserve(static_cast<std::size_t>(rows));
  values_.resize(static_cast<std::size_t>(values));
  std::size_t at = 0;
  dissect(size, coupling, [&](const Front& front) {
    const Supernode& node = nodes_[at++];
    for (std::int32_t own = 0; own < node.columns; ++own)
      rows_.push_back(node.first + own);
    forEachBoundaryVoxel(front, size, coupling, [&](int x, int y, int z) {
      rows_.push_back(placeOf_[static_cast<std::size_t>(size.index(x, y, z))]);
    });
    std::sort(rows_.begin() + node.rowsAt, rows_.end());
  });
}

/// Voxels that share no neighbor are set to one together; what the system makes of them are columns of its matrix. In
/// double precision: the prior's rows add up to zero.
void Factor::assemble(const LinearSystem& system, Execution& execution)
{
  const std::size_t count = placeOf_.size();
  // Gigabytes are cleared in pieces: the system takes its time to hand them out.
  constexpr std::size_t piece = std::size_t{1} << 24;
  for (std::size_t first = 0; first < values_.size(); first += piece) {
    std::fill_n(values_.begin() + static_cast<std::ptrdiff_t>(first), std::min(piece, values_.size() - first), 0.);
    execution.poll();
  }
  std::vector<double> ones(count, 0), product(count);
  SystemProduct times(system);
  const int period = 2 * reach_ + 1;
  const auto forColor = [&](int color, const auto& body) {
    const int cx = color % period, cy = color / period % period, cz = color / (period * period);
    execution.forRange((size_.z - cz + period - 1) / period, 1, [&](std::int64_t begin, std::int64_t) {
      const int z = cz + period * static_cast<int>(begin);
      for (int y = cy; y < size_.y; y += period)
        for (int x = cx; x < size_.x; x += period)
          body(x, y, z);
    });
  };
  const auto setOnes = [&](int color, int value) {
    forColor(color, [&](int x, int y, int z) { ones[static_cast<std::size_t>(size_.index(x, y, z))] = value; });
  };
  for (int color = 0; color < period * period * period; ++color) {
    setOnes(color, 1);
    times.apply(ones, product, execution);
    setOnes(color, 0);
    forColor(color, [&](int x, int y, int z) {
      const std::int32_t column = placeOf_[static_cast<std::size_t>(size_.index(x, y, z))];
      const Supernode& node = nodes_[static_cast<std::size_t>(nodeOf_[static_cast<std::size_t>(column)])];
      for (int c = std::max(z - reach_, 0); c <= std::min(z + reach_, size_.z - 1); ++c)
        for (int b = std::max(y - reach_, 0); b <= std::min(y + reach_, size_.y - 1); ++b)
          for (int a = std::max(x - reach_, 0); a <= std::min(x + reach_, size_.x - 1); ++a) {
            const auto j = static_cast<std::size_t>(size_.index(a, b, c));
            const double value = product[j];
            if (value != 0 && placeOf_[j] >= column)
              block(node, lowerRow(node, 0, placeOf_[j]), column - node.first, 1, 1)(0, 0) = value;
          }
    });
    execution.poll();
  }
}

/// Takes from a block of a supernode what the supernodes before it, and its own columns before the block, contribute.
/// \param product scratch
void Factor::update(const Supernode& node, const std::vector<Descendant>& descendants, std::int32_t column,
                    std::int32_t columns, std::int32_t row, std::int32_t rows, std::vector<double>& product)
{
  Block target = block(node, row, column, rows, columns);
  if (column > 0)
    target.noalias() -= block(node, row, 0, rows, column) * block(node, column, 0, columns, column).transpose();
  const std::int32_t* own = rowsOf(node);
  for (const Descendant& descendant : descendants) {
    const Supernode& other = nodes_[static_cast<std::size_t>(descendant.node)];
    const std::int32_t first = lowerRow(other, descendant.begin, own[column]),
                       last = lowerRow(other, first, own[column + columns - 1] + 1);
    if (first == last)
      continue;
    const std::int32_t from = lowerRow(other, first, own[row]), to = lowerRow(other, from, own[row + rows - 1] + 1);
    if (from == to)
      continue;
    Eigen::Map<Eigen::MatrixXd> part(product.data(), to - from, last - first);
    part.noalias() = block(other, from, 0, to - from, other.columns) *
                     block(other, first, 0, last - first, other.columns).transpose();
    const std::int32_t* places = rowsOf(other);
    for (std::int32_t j = first; j < last; ++j) {
      double* const out = target.col(places[j] - node.first - column).data() - row;
      const double* const in = part.col(j - first).data() - from;
      for (std::int32_t i = from; i < to; ++i)
        out[rowAt_[static_cast<std::size_t>(places[i])]] -= in[i];
    }
  }
}

void Factor::factorize(const Supernode& node, const std::vector<Descendant>& descendants, Execution& execution)
{
  double depth = 0; // products per entry
  for (const Descendant& descendant : descendants)
    depth += nodes_[static_cast<std::size_t>(descendant.node)].columns;
  for (std::int32_t column = 0; column < node.columns; column += panelColumns) {
    const std::int32_t columns = std::min(panelColumns, node.columns - column), below = column + columns;
    const auto forTasks = [&](std::int32_t firstRow, double perTask, const auto& body) {
      const std::int64_t tasks = (node.rows - firstRow + taskRows - 1) / taskRows;
      const auto batch =
          static_cast<std::int64_t>(execution.threads() * std::max(1., std::min(flopsPerPoll / perTask, 1e6)));
      for (std::int64_t first = 0; first < tasks; first += batch) {
        execution.forRange(std::min(batch, tasks - first), 1, [&](std::int64_t task, std::int64_t) {
          const auto row = static_cast<std::int32_t>(firstRow + taskRows * (first + task));
          body(row, std::min(taskRows, node.rows - row));
        });
        execution.poll();
      }
    };
    const double perProduct = 2. * taskRows * columns;
    forTasks(column, perProduct * (depth + column), [&](std::int32_t row, std::int32_t rows) {
      std::vector<double> product(static_cast<std::size_t>(taskRows) * panelColumns);
      update(node, descendants, column, columns, row, rows, product);
    });
    Block diagonal = block(node, column, column, columns, columns);
    Eigen::Ref<Eigen::MatrixXd> inPlace(diagonal);
    const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> factor(inPlace);
    if (factor.info() != Eigen::Success)
      throw SolverFailure("cholesky: the matrix is not positive definite; the observed voxels weigh too little, raise "
                          "beta");
    forTasks(below, perProduct * columns, [&](std::int32_t row, std::int32_t rows) {
      Block part = block(node, row, column, rows, columns);
      diagonal.triangularView<Eigen::Lower>().transpose().solveInPlace<Eigen::OnTheRight>(part);
    });
  }
}

void Factor::factorize(Execution& execution)
{
  const auto work = [](const Supernode& node) { return static_cast<double>(node.columns) * node.rows * node.rows; };
  double done = 0, total = 0;
  for (const Supernode& node : nodes_)
    total += work(node);
  // A supernode waits, with the rows that it has not changed yet, for the one that the first of them belongs to.
  std::vector<std::vector<Descendant>> waiting(nodes_.size());
  const auto wait = [&](std::int32_t index, std::int32_t begin) {
    const Supernode& node = nodes_[static_cast<std::size_t>(index)];
    if (begin == node.rows)
      return;
    const std::int32_t next = nodeOf_[static_cast<std::size_t>(rowsOf(node)[begin])];
    const Supernode& later = nodes_[static_cast<std::size_t>(next)];
    waiting[static_cast<std::size_t>(next)].push_back(
        {index, begin, lowerRow(node, begin, later.first + later.columns)});
  };
  for (std::size_t n = 0; n < nodes_.size(); ++n) {
    const Supernode& node = nodes_[n];
    const std::vector<Descendant> descendants = std::move(waiting[n]);
    for (std::int32_t row = 0; row < node.rows; ++row)
      rowAt_[static_cast<std::size_t>(rowsOf(node)[row])] = row;
    factorize(node, descendants, execution);
    for (const Descendant& descendant : descendants)
      wait(descendant.node, descendant.end);
    wait(static_cast<std::int32_t>(n), node.columns);
    done += work(node);
    execution.progress(done / total);
  }
}

void Factor::solve(std::vector<double>& x, Execution& execution) const
{
  std::vector<double> y(x.size());
  for (std::size_t i = 0; i < x.size(); ++i)
    y[static_cast<std::size_t>(placeOf_[i])] = x[i];
  Eigen::VectorXd rest;
  const auto ownOf = [&](const Supernode& node) {
    return Eigen::Map<Eigen::VectorXd>(y.data() + node.first, node.columns);
  };
  const auto triangle = [&](const Supernode& node) {
    return rowsFrom(node, 0, node.columns).triangularView<Eigen::Lower>();
  };
  const auto below = [&](const Supernode& node) { return rowsFrom(node, node.columns, node.rows - node.columns); };
  for (const Supernode& node : nodes_) {
    Eigen::Map<Eigen::VectorXd> own = ownOf(node);
    triangle(node).solveInPlace(own);
    rest.noalias() = below(node) * own;
    for (std::int32_t row = node.columns; row < node.rows; ++row)
      y[static_cast<std::size_t>(rowsOf(node)[row])] -= rest[row - node.columns];
    execution.poll();
  }
  for (auto node = nodes_.rbegin(); node != nodes_.rend(); ++node) {
    rest.resize(node->rows - node->columns);
    for (std::int32_t row = node->columns; row < node->rows; ++row)
      rest[row - node->columns] = y[static_cast<std::size_t>(rowsOf(*node)[row])];
    Eigen::Map<Eigen::VectorXd> own = ownOf(*node);
    own.noalias() -= below(*node).transpose() * rest;
    const auto lower = triangle(*node);
    lower.transpose().solveInPlace(own);
    execution.poll();
  }
  for (std::size_t i = 0; i < x.size(); ++i)
    x[i] = y[static_cast<std::size_t>(placeOf_[i])];
}

} // namespace

FactorCost choleskyCost(const GridSize& size, Prior prior, bool pointwise)
{
  return factorCost(size, couplingOf(prior, pointwise));
}

void requireFactorFits(const GridSize& size, Prior prior, bool pointwise, const SolverOptions& options)
{
  const double bytes = choleskyCost(size, prior, pointwise).bytes;
  if (bytes > static_cast<double>(options.maxFactorBytes) || size.count() > std::numeric_limits<std::int32_t>::max()) {
    std::ostringstream message;
    message << "cholesky: the factor of " << size.count() << " unknowns would take " << std::ceil(bytes / (1 << 20))
            << " MiB, more than maxFactorBytes (" << (options.maxFactorBytes >> 20)
            << " MiB); use the solver multigrid or larger voxels, or raise the limit";
    throw ResourceLimit(message.str());
  }
}

SolveReport solveCholesky(const LinearSystem& system, const SolverOptions& options, std::vector<double>& d,
                          Execution& execution)
{
  const GridSize size = system.size();
  const bool pointwise = !system.isDiagonal();
  requireFactorFits(size, system.prior.kind, pointwise, options);
  Factor factor(size, couplingOf(system.prior.kind, pointwise));
  factor.assemble(system, execution);
  factor.factorize(execution);
  d = system.rightHandSide;
  factor.solve(d, execution);

  SolveReport report;
  report.method = SolverMethod::cholesky;
  report.iterations = 1;
  report.relativeResidual = relativeResidual(system, d, execution);
  report.converged = true;
  return report;
}

} // namespace mrf
} // namespace pcl
