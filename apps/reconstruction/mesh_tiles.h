// SPDX-License-Identifier: BSD-3-Clause
/// Writes a mesh as a folder of tiles that join exactly.
#pragma once

#include "support/output_files.h"
#include "support/surface_mesh.h"

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace mrf_apps {

/// The folder of the tiles: made if it does not exist, and removed again if it stays empty.
class TileFolder {
public:
  /// \param path empty: no tiles are asked for
  /// \param others further outputs, none of which may be in the folder
  /// \throw FileError if it cannot be made, or is not empty \throw UsageError
  TileFolder(const std::string& path, const std::vector<std::string>& others);
  ~TileFolder();
  TileFolder(const TileFolder&) = delete;
  TileFolder& operator=(const TileFolder&) = delete;

  /// The first file, to be declared before the work.
  std::string firstFile() const { return path_.empty() ? "" : file(0); }

  /// Writes tile_0000.ply … and, as the last file, index.json, which lists them. Each triangle is in one tile; the
  /// vertices of a tile have all fields of the mesh. The mesh is halved across its longest side again and again, so
  /// that all tiles have equally many triangles.
  /// \param largest number of triangles in a tile, > 0 \param outputs where the first file is declared
  /// \return a text for the summary, and the bytes written
  std::pair<std::string, std::int64_t> write(const SurfaceMesh& mesh, std::size_t largest, OutputFiles& outputs) const;

private:
  std::string file(std::size_t number) const;

  std::string path_;
  bool isNew_;
};

} // namespace mrf_apps
