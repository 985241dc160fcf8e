#include <pcl/surface/mrf/exceptions.h>
#include <pcl/surface/mrf/orientation.h>

#include "disjoint_points.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <numeric>
#include <sstream>

namespace pcl {
namespace mrf {
namespace {

/// Points per piece of parallel work: a few milliseconds of queries.
constexpr std::int64_t grain = 1024;

/// Edges per point that are looked at: in a dense overlap of scans all neighbours would be hundreds.
constexpr std::size_t maxNeighbours = 12;

constexpr std::uint32_t noPoint = std::numeric_limits<std::uint32_t>::max();

/// An edge this close to both normals (cosine) leads from one sheet to another, not along a surface.
constexpr float alongNormals = .9f;

/// Points that edges of at least this quality connect form a piece of smooth surface. Edges to an opposite sheet reach
/// it only where sheets are closer than about an eighth of the neighbour distance.
constexpr float smoothQuality = .95f;

/// Pieces of fewer points are too small for a vote of their own.
constexpr std::uint32_t smallestVotingPiece = 12;

/// Union-find that also keeps the sign of each element relative to its root.
class SignedForest {
public:
  explicit SignedForest(std::size_t count) : parent_(count), isFlipped_(count, 0), size_(count, 1)
  {
    std::iota(parent_.begin(), parent_.end(), 0u);
  }

  std::uint32_t root(std::uint32_t i)
  {
    std::uint32_t top = i;
    std::uint8_t flip = 0;
    while (parent_[top] != top) {
      flip ^= isFlipped_[top];
      top = parent_[top];
    }
    while (parent_[i] != top && i != top) {
      const std::uint32_t next = parent_[i];
      const std::uint8_t own = isFlipped_[i];
      parent_[i] = top;
      isFlipped_[i] = flip;
      flip ^= own;
      i = next;
    }
    return top;
  }

  /// \pre root(i) was called since the last join
  bool isFlipped(std::uint32_t i) const { return isFlipped_[i] != 0; }

  /// Joins the trees of i and j so that their signs are opposite or equal. \return false if they were one tree
  bool join(std::uint32_t i, std::uint32_t j, bool opposite)
  {
    std::uint32_t a = root(i), b = root(j);
    if (a == b)
      return false;
    const std::uint8_t flip = isFlipped_[i] ^ isFlipped_[j] ^ static_cast<std::uint8_t>(opposite);
    if (size_[a] < size_[b])
      std::swap(a, b);
    parent_[b] = a;
    isFlipped_[b] = flip;
    size_[a] += size_[b];
    return true;
  }

  std::uint32_t size(std::uint32_t i) { return size_[root(i)]; }

private:
  std::vector<std::uint32_t> parent_;
  std::vector<std::uint8_t> isFlipped_; ///< relative to the parent
  std::vector<std::uint32_t> size_;     ///< valid at roots
};

struct Edge {
  std::uint32_t a, b;
  float quality;     ///< how far the relative sign can be trusted, 0..1
  bool opposite;     ///< the two normals point to opposite sides
  bool withinAngle;  ///< the paper's criterion
  bool acrossSheets; ///< leads along the normals, not along the surface
};

/// Sign and quality of an edge from the reflection of one normal at its bisector plane.
///
/// n_a' = n_a − 2 (ê·n_a) ê equals n_b on a circular arc, and −n_b where the two were given opposite signs. The quality
/// falls with the angle between them and the more the edge leaves the tangent planes: an edge along both normals leads
/// to the opposite sheet of a thin object or, in overlapping scans, to another layer of the same one.
void grade(Edge& edge, const std::vector<Eigen::Vector3f>& positions, const std::vector<Eigen::Vector3f>& normals,
           float minCosine)
{
  const Eigen::Vector3f &na = normals[edge.a], &nb = normals[edge.b];
  const Eigen::Vector3f e = positions[edge.b] - positions[edge.a];
  const float length = e.norm();
  const float ta = length > 0 ? e.dot(na) / length : 0, tb = length > 0 ? e.dot(nb) / length : 0;
  const float cosine = na.dot(nb), reflected = cosine - 2 * ta * tb;
  edge.opposite = reflected < 0;
  edge.withinAngle = std::abs(cosine) >= minCosine;
  edge.acrossSheets = std::min(std::abs(ta), std::abs(tb)) > alongNormals;
  edge.quality = std::clamp(std::abs(reflected) * (1 - std::max(ta * ta, tb * tb)), 0.0f, 1.0f);
}

struct Graph {
  std::vector<Edge> edges;
  std::vector<float> areas; ///< about the area that each point stands for, up to one common factor
};

/// All edges between points that are among the nearest neighbours of each other, and what connectivity needs besides.
Graph connect(const PointSet& points, const std::vector<Eigen::Vector3f>& normals, const NeighbourSearch& search,
              float distance, Execution& execution)
{
  const std::size_t count = points.size();
  const float limit = distance * distance;
  std::vector<std::uint32_t> table(count * maxNeighbours, noPoint);
  Graph graph;
  graph.areas.assign(count, 0);
  const auto hasNormal = [&](std::size_t i) { return !normals[i].isZero(); };
  execution.forRange(static_cast<std::int64_t>(count), grain, [&](std::int64_t begin, std::int64_t end) {
    Neighbours found;
    for (auto i = static_cast<std::size_t>(begin); i < static_cast<std::size_t>(end); ++i) {
      const auto number =
          static_cast<std::size_t>(search.nearest(points.positions[i], static_cast<int>(maxNeighbours) + 1, found));
      std::size_t filled = 0;
      for (std::size_t n = 0; n < number && filled < maxNeighbours; ++n) {
        const auto j = static_cast<std::size_t>(found.indices[n]);
        if (j == i || found.squaredDistances[n] > limit)
          continue;
        graph.areas[i] = found.squaredDistances[n] / static_cast<float>(filled + 1);
        table[i * maxNeighbours + filled++] = static_cast<std::uint32_t>(j);
      }
    }
  });

  const auto lists = [&](std::size_t i, std::uint32_t j) {
    const auto first = table.begin() + static_cast<std::ptrdiff_t>(i * maxNeighbours);
    return std::find(first, first + maxNeighbours, j) != first + maxNeighbours;
  };
  SignedForest forest(count);
  const auto add = [&](std::size_t i, std::uint32_t j) {
    graph.edges.push_back({static_cast<std::uint32_t>(i), j, 0, false, false, false});
  };
  for (std::size_t i = 0; i < count; ++i)
    for (std::size_t n = 0; n < maxNeighbours; ++n) {
      const std::uint32_t j = table[i * maxNeighbours + n];
      if (j == noPoint)
        break;
      if (!hasNormal(i) || !hasNormal(j) || (j < i && lists(j, static_cast<std::uint32_t>(i))))
        continue;
      add(i, j);
      forest.join(static_cast<std::uint32_t>(i), j, false);
    }

  // The nearest neighbours of a scan line may all lie on it: look at the whole radius where the cap cut a piece off.
  std::vector<std::uint32_t> piece(count);
  std::uint32_t largest = 0;
  for (std::size_t i = 0; i < count; ++i) {
    piece[i] = forest.root(static_cast<std::uint32_t>(i));
    if (forest.size(piece[i]) > forest.size(largest))
      largest = piece[i];
  }
  Neighbours found;
  std::vector<std::uint32_t> reached;
  for (std::size_t i = 0; i < count; ++i) {
    if (piece[i] == piece[largest] || !hasNormal(i) || table[(i + 1) * maxNeighbours - 1] == noPoint)
      continue;
    const auto number = static_cast<std::size_t>(search.within(points.positions[i], distance, found));
    reached.assign(1, piece[i]);
    for (std::size_t n = 0; n < number; ++n) {
      const auto j = static_cast<std::uint32_t>(found.indices[n]);
      if (!hasNormal(j) || std::find(reached.begin(), reached.end(), piece[j]) != reached.end())
        continue;
      reached.push_back(piece[j]);
      add(i, j);
    }
  }
  return graph;
}

/// Edges, best first; equals in the order they were found.
std::vector<std::uint32_t> bestFirst(const std::vector<Edge>& edges)
{
  std::vector<std::uint64_t> keys(edges.size());
  for (std::size_t e = 0; e < edges.size(); ++e) {
    const float badness = 1 - edges[e].quality;
    std::uint32_t bits = 0;
    std::memcpy(&bits, &badness, sizeof bits); // ordered like the value, which is not negative
    keys[e] = std::uint64_t{bits} << 32 | e;
  }
  std::sort(keys.begin(), keys.end());
  std::vector<std::uint32_t> order(edges.size());
  for (std::size_t e = 0; e < order.size(); ++e)
    order[e] = static_cast<std::uint32_t>(keys[e]);
  return order;
}

/// The connected components and the signs that make the normals of each consistent.
struct Components {
  std::vector<std::uint32_t> label;    ///< smallest index of a point of the same component
  std::vector<std::uint8_t> isFlipped; ///< per point
  std::vector<std::uint32_t> size;     ///< at labels, 0 elsewhere
};

/// Per element the smallest one of its tree.
std::vector<std::uint32_t> labelsOf(SignedForest& forest, std::size_t count)
{
  std::vector<std::uint32_t> smallest(count, noPoint), labels(count);
  for (std::uint32_t i = 0; i < count; ++i) {
    std::uint32_t& label = smallest[forest.root(i)];
    label = std::min(label, i);
    labels[i] = label;
  }
  return labels;
}

Components findComponents(std::size_t count, const std::vector<Edge>& edges,
                          const std::function<bool(const Edge&, SignedForest&)>& isUsed)
{
  SignedForest forest(count);
  for (const std::uint32_t e : bestFirst(edges))
    if (isUsed(edges[e], forest))
      forest.join(edges[e].a, edges[e].b, edges[e].opposite);

  Components components;
  components.label = labelsOf(forest, count);
  components.isFlipped.assign(count, 0);
  components.size.assign(count, 0);
  std::vector<std::uint32_t> flipped(count, 0);
  for (std::uint32_t i = 0; i < count; ++i) {
    components.isFlipped[i] = forest.isFlipped(i);
    ++components.size[components.label[i]];
    flipped[components.label[i]] += components.isFlipped[i];
  }
  // Most normals keep the sign they came with, so that flips mean something where normals were given.
  for (std::uint32_t i = 0; i < count; ++i) {
    const std::uint32_t label = components.label[i];
    if (2 * flipped[label] > components.size[label])
      components.isFlipped[i] ^= 1;
  }
  return components;
}

/// Labels of the pieces of smooth surface.
std::vector<std::uint32_t> smoothPieces(std::size_t count, const std::vector<Edge>& edges)
{
  SignedForest forest(count);
  for (const Edge& edge : edges)
    if (edge.quality >= smoothQuality)
      forest.join(edge.a, edge.b, false);
  return labelsOf(forest, count);
}

/// The sensor that saw a point: of its view, or the nearest one where the view is not known.
const Eigen::Vector3f& sensorOf(const PointSet& points, std::size_t i)
{
  if (!points.views.empty() && points.views[i] >= 0 &&
      static_cast<std::size_t>(points.views[i]) < points.sensors.size())
    return points.sensors[static_cast<std::size_t>(points.views[i])];
  const auto distance = [&](const Eigen::Vector3f& sensor) { return (sensor - points.positions[i]).squaredNorm(); };
  return *std::min_element(
      points.sensors.begin(), points.sensors.end(),
      [&](const Eigen::Vector3f& s, const Eigen::Vector3f& t) { return distance(s) < distance(t); });
}

/// What a point's normal, as it is, says about its component's sign: value > 0 for, < 0 against, |value| ≤ weight.
struct Vote {
  double value = 0, weight = 0;
};

std::vector<Vote> votesOf(const PointSet& points, const std::vector<Eigen::Vector3f>& normals,
                          const std::vector<float>& areas, const Components& components, OrientationVote vote)
{
  const std::size_t count = points.size();
  std::vector<Vote> votes(count);
  const auto sign = [](float value) { return Vote{value > 0 ? 1.0 : value < 0 ? -1.0 : 0.0, value != 0 ? 1.0 : 0.0}; };
  if (vote == OrientationVote::reference) {
    for (std::size_t i = 0; i < count; ++i)
      votes[i] = sign(normals[i].dot(points.normals[i]));
  } else if (vote == OrientationVote::sensor) {
    for (std::size_t i = 0; i < count; ++i)
      votes[i] = sign(normals[i].dot(sensorOf(points, i) - points.positions[i]));
  } else if (vote == OrientationVote::outward) {
    std::vector<Eigen::Vector4d> moments(count, Eigen::Vector4d::Zero());
    for (std::size_t i = 0; i < count; ++i)
      moments[components.label[i]] += double{areas[i]} * points.positions[i].cast<double>().homogeneous();
    for (std::size_t i = 0; i < count; ++i) {
      const Eigen::Vector4d& moment = moments[components.label[i]];
      if (!(moment.w() > 0))
        continue;
      const Eigen::Vector3d arm = points.positions[i].cast<double>() - moment.hnormalized();
      votes[i].value = areas[i] * normals[i].cast<double>().dot(arm);
      // A flat patch has no outside: what rounding and noise leave there must not look like agreement.
      votes[i].weight = std::max(std::abs(votes[i].value), .01 * areas[i] * arm.norm());
    }
  }
  return votes;
}

struct Tally {
  double balance = 0, total = 0;
  std::uint32_t points = 0;

  /// Three quarters of the votes of a piece that is large enough.
  bool isDecidedlyAgainst() const { return points >= smallestVotingPiece && -balance >= .5 * total && total > 0; }
};

/// Sums of the votes per label, stored at the label.
std::vector<Tally> tally(const std::vector<std::uint32_t>& labels, const std::vector<Vote>& votes)
{
  std::vector<Tally> tallies(labels.size());
  for (std::size_t i = 0; i < labels.size(); ++i) {
    Tally& own = tallies[labels[i]];
    own.balance += votes[i].value;
    own.total += votes[i].weight;
    ++own.points;
  }
  return tallies;
}

/// The components of points whose signs are known: no edge has to be sorted, or kept.
///
/// Nearly all points are joined to one component by edges to their nearest neighbours. An edge between two components
/// ends at a point outside of the largest one, so looking at all edges of those finds the rest.
OrientationResult findComponents(const PointSet& points, const std::vector<Eigen::Vector3f>& normals,
                                 const NeighbourSearch& search, float distance, float minCosine,
                                 const OrientationOptions& options, Execution& execution)
{
  constexpr int nearest = 5; // the point itself among them: four join nearly all of a surface
  const std::size_t count = points.size();
  const float limit = distance * distance;
  DisjointPoints joined(count), smooth(count);
  const auto join = [&](std::uint32_t i, std::uint32_t j) {
    const Eigen::Vector3f &a = normals[i], &b = normals[j];
    if (i == j || a.isZero() || b.isZero())
      return;
    const Eigen::Vector3f edge = points.positions[j] - points.positions[i];
    const float alongA = edge.dot(a), alongB = edge.dot(b);
    const float along = alongNormals * alongNormals * edge.squaredNorm();
    const bool acrossSheets = alongA * alongA > along && alongB * alongB > along;
    const bool withinAngle = std::abs(a.dot(b)) >= minCosine;
    if (withinAngle)
      smooth.join(i, j);
    // Without a vote from outside, two sheets can only be taken for the two sides of one object.
    if (!acrossSheets && (withinAngle || options.joinAcrossCreases))
      joined.join(i, j);
  };
  search.forEachPosition(points.positions, nearest, NeighbourSearch::Answer::indicesAndDistances, execution,
                         [&](const NeighbourBatch& batch) {
                           for (std::size_t n = 0; n < batch.size * batch.k; ++n)
                             if (batch.squaredDistances[n] <= limit)
                               join(batch.positions[n / batch.k], batch.indices[n]);
                         });
  execution.poll();

  const auto largest = [](const std::vector<std::uint32_t>& sizes) {
    return static_cast<std::uint32_t>(std::max_element(sizes.begin(), sizes.end()) - sizes.begin());
  };
  std::vector<std::uint8_t> isApart(count);
  const std::uint32_t most = largest(joined.sizes()), mostSmooth = largest(smooth.sizes());
  for (std::uint32_t i = 0; i < count; ++i)
    isApart[i] =
        !normals[i].isZero() && (joined.find(i) != joined.find(most) || smooth.find(i) != smooth.find(mostSmooth));
  const float closed = std::nextafter(distance, std::numeric_limits<float>::max());
  execution.forRange(static_cast<std::int64_t>(count), grain, [&](std::int64_t begin, std::int64_t end) {
    Neighbours found;
    for (auto i = static_cast<std::size_t>(begin); i < static_cast<std::size_t>(end); ++i) {
      const int number = isApart[i] ? search.within(points.positions[i], closed, found) : 0;
      for (int n = 0; n < number; ++n)
        join(static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(found.indices[static_cast<std::size_t>(n)]));
    }
  });
  execution.poll();

  OrientationResult result;
  result.normals = normals;
  result.keep.assign(count, 0);
  const std::vector<std::uint32_t> sizes = joined.sizes();
  const double smallest = options.minComponentShare * static_cast<double>(count);
  for (std::uint32_t i = 0; i < count; ++i) {
    if (normals[i].isZero())
      continue;
    const std::uint32_t root = joined.find(i);
    result.keep[i] = sizes[root] >= smallest ? 1 : 0;
    if (root == i) {
      ++result.components;
      result.componentsDropped += result.keep[i] ? 0 : 1;
    }
    result.componentsAtCreases += smooth.find(i) == i ? 1 : 0;
  }
  result.pointsDropped = std::count(result.keep.begin(), result.keep.end(), std::uint8_t{0});
  return result;
}

template <typename Value>
[[noreturn]] void refuse(const char* name, Value value, const char* range)
{
  std::ostringstream text;
  text << "orientation." << name << " = " << value << " is outside its range " << range;
  throw InvalidOption(text.str());
}

void checkInput(const PointSet& points, const std::vector<Eigen::Vector3f>& normals, OrientationVote vote)
{
  if (normals.size() != points.size())
    throw InvalidInput("orientation got " + std::to_string(normals.size()) + " normals for " +
                       std::to_string(points.size()) + " points");
  if (vote == OrientationVote::sensor && points.sensors.empty())
    throw InvalidInput("an orientation by sensors needs at least one sensor position");
  if (vote == OrientationVote::reference && points.normals.size() != points.size())
    throw InvalidInput("an orientation by reference normals needs a cloud with normals");
}

} // namespace

void validate(const OrientationOptions& options)
{
  if (!(options.neighbourDistance >= 0) || !std::isfinite(options.neighbourDistance))
    refuse("neighbourDistance", options.neighbourDistance, ">= 0 (0 = derived from the sampling density)");
  if (!(options.maxAngle > 0 && options.maxAngle <= 90))
    refuse("maxAngle", options.maxAngle, "(0, 90] degrees");
  if (!(options.minComponentShare >= 0 && options.minComponentShare < 1))
    refuse("minComponentShare", options.minComponentShare, "[0, 1) (0 = keep all components)");
  if (!(options.lowAgreement >= 0 && options.lowAgreement <= 1))
    refuse("lowAgreement", options.lowAgreement, "[0, 1] (0 = never warn)");
}

float resolvedNeighbourDistance(const OrientationOptions& options, const SamplingDensity& density)
{
  return options.neighbourDistance > 0
             ? options.neighbourDistance
             : std::max(density.spacing + 6 * density.nearestDeviation, 2.5f * density.spacing);
}

OrientationResult orientNormals(const PointSet& points, const std::vector<Eigen::Vector3f>& normals,
                                const NeighbourSearch& search, const SamplingDensity& density, OrientationVote vote,
                                const OrientationOptions& options, Execution& execution)
{
  validate(options);
  checkInput(points, normals, vote);
  const std::size_t count = points.size();
  const float distance = resolvedNeighbourDistance(options, density);

  const auto minCosine = static_cast<float>(std::cos(options.maxAngle * EIGEN_PI / 180));
  if (vote == OrientationVote::none)
    return findComponents(points, normals, search, distance, minCosine, options, execution);

  Graph graph = connect(points, normals, search, distance, execution);
  execution.forRange(static_cast<std::int64_t>(graph.edges.size()), 16 * grain,
                     [&](std::int64_t begin, std::int64_t end) {
                       for (std::int64_t e = begin; e < end; ++e)
                         grade(graph.edges[static_cast<std::size_t>(e)], points.positions, normals, minCosine);
                     });
  execution.poll();

  SignedForest smooth(count);
  std::int64_t smoothJoins = 0;
  for (const Edge& edge : graph.edges)
    if (edge.withinAngle)
      smoothJoins += smooth.join(edge.a, edge.b, false);

  const double smallest = options.minComponentShare * static_cast<double>(count);
  const Components components = findComponents(count, graph.edges, [&](const Edge& edge, SignedForest& forest) {
    if (edge.acrossSheets)
      // Without a vote from outside, two sheets can only be taken for the two sides of one object.
      return options.joinAcrossCreases && vote == OrientationVote::outward && forest.size(edge.a) >= smallest &&
             forest.size(edge.b) >= smallest;
    return options.joinAcrossCreases || edge.withinAngle;
  });

  OrientationResult result;
  result.keep.assign(count, 0);
  std::int64_t withNormal = 0;
  for (std::size_t i = 0; i < count; ++i) {
    if (normals[i].isZero())
      continue;
    ++withNormal;
    const bool isKept = components.size[components.label[i]] >= smallest;
    result.keep[i] = isKept ? 1 : 0;
    if (components.label[i] == i) {
      ++result.components;
      result.componentsDropped += isKept ? 0 : 1;
    }
  }
  result.componentsAtCreases = withNormal - smoothJoins;
  result.pointsDropped = std::count(result.keep.begin(), result.keep.end(), std::uint8_t{0});

  result.normals = normals;
  for (std::size_t i = 0; i < count; ++i)
    if (components.isFlipped[i])
      result.normals[i] = -normals[i];
  std::vector<Vote> votes = votesOf(points, result.normals, graph.areas, components, vote);
  const auto turn = [&](std::size_t i) {
    result.normals[i] = -result.normals[i];
    votes[i].value = -votes[i].value;
  };

  const std::vector<Tally> tallies = tally(components.label, votes);
  for (std::size_t i = 0; i < count; ++i)
    if (tallies[components.label[i]].balance < 0) {
      turn(i);
      result.componentsFlipped += result.keep[i] && components.label[i] == i;
    }

  const bool knowsViews = vote == OrientationVote::sensor && (!points.views.empty() || points.sensors.size() == 1);
  if (vote == OrientationVote::reference || knowsViews) {
    const std::vector<std::uint32_t> piece = smoothPieces(count, graph.edges);
    const std::vector<Tally> pieceTallies = tally(piece, votes);
    for (std::size_t i = 0; i < count; ++i)
      if (pieceTallies[piece[i]].isDecidedlyAgainst()) {
        turn(i);
        result.piecesFlipped += result.keep[i] && piece[i] == i;
      }
  }

  double agreeing = 0, total = 0;
  for (std::size_t i = 0; i < count; ++i) {
    if (!result.keep[i])
      continue;
    result.pointsFlipped += result.normals[i].dot(normals[i]) < 0;
    agreeing += (votes[i].weight + votes[i].value) / 2;
    total += votes[i].weight;
  }
  if (total > 0)
    result.agreement = agreeing / total;
  return result;
}

} // namespace mrf
} // namespace pcl
