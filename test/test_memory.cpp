#include "benchmark/heap.h"
#include "support/shapes.h"

#include <pcl/surface/mrf/multiscale.h>

#include <gtest/gtest.h>

#include <cmath>

using namespace pcl::mrf;

TEST(Memory, IsPredicted)
{
  const double radius = 1, area = 4 * M_PI;
  for (double voxels : {38., 60.}) {
    const auto h = static_cast<float>(2 * radius / voxels);
    const PointSet points = shapes::sample(shapes::sphere(radius), 1.2, h);
    const auto spacing = static_cast<float>(.5 * std::sqrt(area / static_cast<double>(points.size())));
    const auto search = makeKdTree();
    search->setPoints(points.positions);
    const OrientedPoints oriented = shapes::oriented(points);
    for (const int threads : {1, 2})
    for (const Estimate estimate : {Estimate::points, Estimate::median})
      for (const Energy energy : {Energy::joint, Energy::weighted})
        if (threads != 2 || voxels < 50) for (const SolverMethod method : {SolverMethod::multigrid, SolverMethod::icm, SolverMethod::cg, SolverMethod::cholesky})
          for (const Prior prior : {Prior::membrane, Prior::thinPlate, Prior::triharmonic}) {
            if (method == SolverMethod::cholesky && (prior != Prior::membrane || voxels > 50))
              continue;
            if (estimate == Estimate::points && energy == Energy::weighted)
              continue;
            ObservationOptions observation;
            observation.estimate = estimate;
            observation.smoothing = spacing / 2;
            PriorOptions priorOptions;
            priorOptions.prior = prior;
            priorOptions.energy = energy;
            SolverOptions solver;
            solver.method = method;
            solver.maxIterations = 2;
            MultiscaleOptions options;
            options.voxelSize = h;
            options.denseVoxels = 1 << 30;
            Execution execution(threads);
            const std::int64_t before = benchmarks::heapBytes();
            benchmarks::resetPeak();
            const MultiscaleResult result = regularise(oriented, *search, spacing, boundingBox(oriented.positions), observation, priorOptions, solver, options, execution);
            const double measured = static_cast<double>(benchmarks::peakBytes() - before);
            const LevelReport& finest = result.levels.back();
            const double n = static_cast<double>(finest.size.count());
            Workload workload;
            workload.points = static_cast<double>(oriented.size());
            workload.area = area;
            workload.reach = estimate == Estimate::points ? 0 : resolvedMaxDistance(observation, spacing, h);
            workload.prior = priorOptions;
            workload.solver = solver;
            const double predicted = predictedMemory(boundingBox(oriented.positions), h, workload, options, threads);
            std::printf("%5.2f threads %d points %zu voxels %.0f observed %lld at %s energy %d solver %d k %d: %.1f MB, %.1f B/voxel\n", predicted / measured, threads, oriented.size(), n, static_cast<long long>(finest.observed),
                        estimate == Estimate::points ? "points" : "voxels", static_cast<int>(energy), static_cast<int>(method), static_cast<int>(prior), measured / 1e6, measured / n);
          }
  }
}
