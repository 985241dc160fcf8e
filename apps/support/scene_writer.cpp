// SPDX-License-Identifier: BSD-3-Clause
#include "module.h"

#include <assimp/Exporter.hpp>
#include <assimp/material.h>
#include <assimp/scene.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>

namespace mrf_apps {
namespace {

/// Converts a color channel from sRGB to linear light (IEC 61966-2-1), which glTF wants.
float linear(float channel)
{
  return channel <= .04045f ? channel / 12.92f : std::pow((channel + .055f) / 1.055f, 2.4f);
}

std::unique_ptr<aiMesh> meshOf(const SurfaceMesh& mesh, const Eigen::Vector3d& offset, bool areColorsLinear)
{
  auto result = std::make_unique<aiMesh>();
  const auto toVector = [](const Eigen::Vector3f& v) { return aiVector3D(v.x(), v.y(), v.z()); };
  result->mPrimitiveTypes = aiPrimitiveType_TRIANGLE;
  result->mNumVertices = static_cast<unsigned>(mesh.vertices.size());
  result->mVertices = new aiVector3D[mesh.vertices.size()];
  std::transform(mesh.vertices.begin(), mesh.vertices.end(), result->mVertices,
                 [&](const Eigen::Vector3d& vertex) { return toVector((vertex - offset).cast<float>()); });
  if (!mesh.normals.empty()) {
    result->mNormals = new aiVector3D[mesh.normals.size()];
    std::transform(mesh.normals.begin(), mesh.normals.end(), result->mNormals, toVector);
  }
  if (!mesh.colors.empty()) {
    result->mColors[0] = new aiColor4D[mesh.colors.size()];
    const auto channel = [&](std::uint8_t value) {
      const float share = static_cast<float>(value) / 255;
      return areColorsLinear ? linear(share) : share;
    };
    std::transform(mesh.colors.begin(), mesh.colors.end(), result->mColors[0], [&](const auto& color) {
      return aiColor4D(channel(color[0]), channel(color[1]), channel(color[2]), 1);
    });
  }
  result->mNumFaces = static_cast<unsigned>(mesh.triangles.size());
  result->mFaces = new aiFace[mesh.triangles.size()];
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    aiFace& face = result->mFaces[t];
    face.mNumIndices = 3;
    face.mIndices = new unsigned[3];
    std::copy(mesh.triangles[t].begin(), mesh.triangles[t].end(), face.mIndices);
  }
  return result;
}

/// A matte material, white unless the vertices have colors, visible from both sides because surfaces may be open.
std::unique_ptr<aiMaterial> plainMaterial()
{
  auto material = std::make_unique<aiMaterial>();
  const aiColor4D white(1, 1, 1, 1);
  const float metallic = 0, roughness = 1;
  const int twoSided = 1;
  material->AddProperty(&white, 1, AI_MATKEY_BASE_COLOR);
  material->AddProperty(&white, 1, AI_MATKEY_COLOR_DIFFUSE);
  material->AddProperty(&metallic, 1, AI_MATKEY_METALLIC_FACTOR);
  material->AddProperty(&roughness, 1, AI_MATKEY_ROUGHNESS_FACTOR);
  material->AddProperty(&twoSided, 1, AI_MATKEY_TWOSIDED);
  return material;
}

/// The bytes of a file that Assimp's exporter writes by name; empty if that fails. Assimp does not report a full disk,
/// so the end record of the archive is looked for.
std::string exportedByName(const aiScene& scene, Assimp::Exporter& exporter, const char* id)
{
  std::string folder = (std::filesystem::temp_directory_path() / "scene-XXXXXX").string();
  if (mkdtemp(folder.data()) == nullptr)
    throw FileError(folder, std::strerror(errno));
  const std::string path = folder + "/scene";
  exporter.Export(&scene, id, path);
  std::ifstream stream(path, std::ios::binary);
  std::string bytes(std::istreambuf_iterator<char>(stream), {});
  std::error_code ignored;
  std::filesystem::remove_all(folder, ignored);
  return bytes.rfind("PK\5\6") == std::string::npos ? "" : bytes;
}

std::string exported(const aiScene& scene, Assimp::Exporter& exporter, const std::string& format)
{
  if (format == "3mf")
    return exportedByName(scene, exporter, "3mf");
  const aiExportDataBlob* const blob = exporter.ExportToBlob(&scene, format == "glb" ? "glb2" : "collada");
  return blob == nullptr ? "" : std::string(static_cast<const char*>(blob->data), blob->size);
}

std::string sceneBytes(const SurfaceMesh& mesh, const Eigen::Vector3d& offset, const std::string& format)
{
  aiScene scene; // owns all that it points to
  scene.mMaterials = new aiMaterial* [1] {};
  scene.mMaterials[0] = plainMaterial().release();
  scene.mNumMaterials = 1;
  scene.mMeshes = new aiMesh* [1] {};
  scene.mMeshes[0] = meshOf(mesh, offset, format == "glb").release();
  scene.mNumMeshes = 1;
  scene.mRootNode = new aiNode("scene");
  auto* surface = new aiNode("surface"); // the 3MF exporter leaves out meshes of the root itself
  surface->mMeshes = new unsigned[1]{};
  surface->mNumMeshes = 1;
  scene.mRootNode->addChildren(1, &surface);
  Assimp::Exporter exporter;
  std::string bytes = exported(scene, exporter, format);
  if (bytes.empty())
    throw FileError(format + " cannot be written: " + exporter.GetErrorString());
  return bytes;
}

} // namespace

extern "C" __attribute__((visibility("default"))) const SceneWriter sceneWriter = {sceneBytes};

} // namespace mrf_apps
