// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief What an experiment is: cases that are measured once and kept, and a section of the page made of them.
#pragma once

#include "scan/sampling.h"
#include "support/picture.h"
#include "support/surface_mesh.h"

#include <pcl/surface/mrf/execution.h>

#include <nlohmann/json.hpp>

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace mrf_apps {

/// Rows of numbers, words or null. Written as CSV under its name, too.
struct Table {
  std::string name; ///< of the file: letters, digits and dashes
  std::string title;
  std::vector<std::string> columns; ///< with their units
  std::vector<std::vector<nlohmann::json>> rows;
};

struct Curve {
  std::string name;
  std::vector<double> x, y;
};

struct Plot {
  enum class Kind { lines, bars };
  std::string name, title, xLabel, yLabel;
  Kind kind = Kind::lines;
  bool logX = false, logY = false;
  std::vector<Curve> curves;
};

/// A PNG file in the folder of the results.
struct Picture {
  std::string file;
  std::string caption;
};

/// One experiment's part of the page.
struct Section {
  std::string id; ///< "fig-2", "table-1"; also the word by which it is chosen
  std::string title;
  std::vector<std::string> paragraphs; ///< what was done, and how to read it
  std::vector<Table> tables;
  std::vector<Plot> plots;
  std::vector<Picture> pictures;
};

struct ExperimentOptions {
  std::string folder;      ///< receives everything
  bool quick = false;      ///< fewer scans, holes and settings, coarser grids: minutes instead of hours
  std::uint64_t seed = 1;  ///< of all scans
  std::string data;        ///< folder of further scans and clouds; empty: none
  bool hasPictures = true; ///< needs a display
  /// Of the scans of Table 1 and of the defaults. Neat scans are even, most real ones are not.
  pcl::mrf::scan::Pattern sampling = pcl::mrf::scan::Pattern::even;
};

/// What experiments are run in: their options, what was measured before, the folder of results.
class Laboratory {
public:
  virtual ~Laboratory() = default;

  virtual const ExperimentOptions& options() const = 0;
  virtual pcl::mrf::Execution& execution() = 0;

  /// The result of one case: as an earlier run of the same experiment left it, or else computed and kept at once, so
  /// that an interrupted run goes on where it was. Keys name everything that the result depends on beside the program,
  /// the seed and `quick`. An exception of pcl::mrf is kept, too, as {"failed": message}.
  virtual nlohmann::json measure(const std::string& key, const std::function<nlohmann::json()>& compute) = 0;

  /// Renders the mesh into a PNG file of the results, unless it is there from an earlier run or pictures are off.
  /// The mesh is only asked for when it is needed.
  virtual void draw(const std::string& file, const PictureOptions& options,
                    const std::function<SurfaceMesh()>& mesh) = 0;
};

struct Experiment {
  std::string id;
  std::string title;
  std::function<Section(Laboratory&)> run;
};

/// All of them, in the order of the paper.
const std::vector<Experiment>& experiments();

} // namespace mrf_apps
