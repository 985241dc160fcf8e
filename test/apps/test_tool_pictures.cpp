// SPDX-License-Identifier: BSD-3-Clause
// Pictures: the tool's own, and what pcl_viewer shows of its output.
#include "support/tool.h"

#include <vtkImageData.h>
#include <vtkPNGReader.h>
#include <vtkSmartPointer.h>

#include <algorithm>
#include <array>

namespace {

/// Pixels of a picture by what they show.
struct Pixels {
  int all = 0, skin = 0, blue = 0, light = 0;
  int border = 0; ///< of skin or blue at the picture's border
  /// Of those of skin, from the picture's middle to the right and up, in its sides.
  double skinRight = 0, skinUp = 0;
};

Pixels countPixels(const std::string& path)
{
  auto reader = vtkSmartPointer<vtkPNGReader>::New();
  reader->SetFileName(path.c_str());
  reader->Update();
  vtkImageData* image = reader->GetOutput();
  Pixels pixels;
  for (vtkIdType i = 0; i < image->GetNumberOfPoints(); ++i) {
    std::array<int, 3> rgb{};
    const int components = image->GetNumberOfScalarComponents();
    const auto* bytes = static_cast<const unsigned char*>(image->GetScalarPointer()) + i * components;
    for (int channel = 0; channel < 3; ++channel)
      rgb[channel] = bytes[components < 3 ? 0 : channel];
    ++pixels.all;
    // Shading scales the channels; what tells the two colors apart is which one leads, and clearly.
    const bool isSkin = rgb[0] > 40 && rgb[0] > 1.15 * rgb[2];
    pixels.skin += isSkin;
    const int width = image->GetDimensions()[0], height = image->GetDimensions()[1];
    const vtkIdType column = i % width, row = i / width; // VTK's images start at the bottom
    if (isSkin) {
      pixels.skinRight += static_cast<double>(column) / width - .5;
      pixels.skinUp += static_cast<double>(row) / height - .5;
    }
    const bool isBlue = rgb[2] > 40 && rgb[2] > 1.5 * rgb[0];
    pixels.blue += isBlue;
    const bool isAtBorder = column == 0 || row == 0 || column + 1 == width || row + 1 == height;
    pixels.border += isAtBorder && (isSkin || isBlue);
    pixels.light += std::min({rgb[0], rgb[1], rgb[2]}) > 200;
  }
  if (pixels.skin > 0) {
    pixels.skinRight /= pixels.skin;
    pixels.skinUp /= pixels.skin;
  }
  return pixels;
}

/// A plane two units before the origin as a PLY file, facing it, blue with a quarter in red where x and y are negative.
std::string planeBeforeCamera(double height = 1)
{
  constexpr int side = 40;
  std::string text = "ply\nformat ascii 1.0\nelement vertex " + std::to_string(side * side) + "\n";
  for (const char* name : {"x", "y", "z", "nx", "ny", "nz"})
    text += "property float " + std::string(name) + "\n";
  for (const char* name : {"red", "green", "blue"})
    text += "property uchar " + std::string(name) + "\n";
  text += "end_header\n";
  for (int i = 0; i < side * side; ++i) {
    const double x = (i % side + .5) / side - .5, y = height * ((i / side + .5) / side - .5);
    text +=
        std::to_string(x) + " " + std::to_string(y) + " 2 0 0 -1 " + (x < 0 && y < 0 ? "220 60 40\n" : "30 60 220\n");
  }
  return text;
}

class ToolPictures : public tool::Test {
protected:
  void SetUp() override
  {
    if (!tool::hasProgram("xvfb-run"))
      GTEST_SKIP() << "xvfb-run is not installed";
    // A third of the sphere is missing: blue there, skin elsewhere.
    write("sphere.xyz", tool::sphereRows(1500, .3));
  }

  tool::Outcome runUnderX(const std::vector<std::string>& command) const
  {
    std::vector<std::string> all = {"xvfb-run", "-a", "-s", "-screen 0 800x600x24"};
    all.insert(all.end(), command.begin(), command.end());
    return tool::runProgram(all, path(""));
  }
};

TEST_F(ToolPictures, ShowsTheSurfaceWithItsColors)
{
  const tool::Outcome outcome = runUnderX(
      {MRF_TOOL, "sphere.xyz", "out.ply", "--color", "confidence", "--max-hole", "5", "--picture", "out.png"});
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_EQ(outcome.err, "");
  const Pixels pixels = countPixels(path("out.png"));
  EXPECT_EQ(pixels.all, 1000 * 1000);
  // A sphere that fills the picture's height covers .79 of it; the camera leaves a margin.
  EXPECT_GT(pixels.skin + pixels.blue, .3 * pixels.all);
  EXPECT_GT(pixels.skin, .05 * pixels.all);
  EXPECT_GT(pixels.blue, .02 * pixels.all); // the third is seen from the side
  EXPECT_GT(pixels.light, .1 * pixels.all);
}

TEST_F(ToolPictures, ShowsAllOfTheSurface)
{
  // Twice as high as wide: nothing of it may reach the picture's border.
  write("plane.ply", planeBeforeCamera(2));
  ASSERT_EQ(runUnderX({MRF_TOOL, "plane.ply", "out.ply", "--picture", "out.png", "-q"}).status, 0);
  const Pixels pixels = countPixels(path("out.png"));
  EXPECT_EQ(pixels.border, 0);
  EXPECT_GT(pixels.skin + pixels.blue, .3 * pixels.all);
}

TEST_F(ToolPictures, LooksFromTheSensor)
{
  write("plane.ply", planeBeforeCamera());
  // In a camera's frame x points to the right and y down: the red quarter is at the upper left.
  ASSERT_EQ(runUnderX({MRF_TOOL, "plane.ply", "out.ply", "--sensor", "0,0,0", "--picture", "camera.png", "-q"}).status,
            0);
  const Pixels camera = countPixels(path("camera.png"));
  // The plane's corners reach the picture's side, half of a square in a circle; the middle of the quarter is then a
  // quarter of 1/√2 off. The perspective and the rim make a few per cent.
  EXPECT_NEAR(camera.skinRight, -.177, .02);
  EXPECT_NEAR(camera.skinUp, .177, .02);
  EXPECT_NEAR(static_cast<double>(camera.skin) / camera.all, .125, .02);

  // From beside it, with y up as for any sensor that is not at its frame's origin: x points to the left.
  ASSERT_EQ(
      runUnderX({MRF_TOOL, "plane.ply", "out.ply", "--sensor", "-1,0,-.5", "--picture", "beside.png", "-q"}).status, 0);
  const Pixels beside = countPixels(path("beside.png"));
  EXPECT_GT(beside.skinRight, .02);
  EXPECT_LT(beside.skinUp, -.02);

  // A sensor within the plane cannot see it.
  ASSERT_EQ(runUnderX({MRF_TOOL, "plane.ply", "out.ply", "--sensor", "0,0,1.99", "--picture", "amid.png", "-q"}).status,
            0);
  EXPECT_GT(countPixels(path("amid.png")).blue, .1 * camera.all);
}

TEST_F(ToolPictures, PclViewerShowsAColoredSurface)
{
  if (!tool::hasProgram("pcl_viewer") || !tool::hasProgram("import"))
    GTEST_SKIP() << "pcl_viewer or ImageMagick's import is not installed";
  const tool::Outcome outcome = run({"sphere.xyz", "out.vtk", "--color", "confidence", "--max-hole", "5", "-q"});
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  // The empty screen first: the counts below must come from the viewer. It draws some time after its start, and looks
  // from a fixed place, mostly inside a mesh.
  write("view.sh", "import -window root before.png\n"
                   "pcl_viewer -cam 0.1,20/0,0,0/4,0,4/0,1,0/0.6/700,500/0,0 out.vtk >viewer.log 2>&1 &\n"
                   "viewer=$!\n"
                   "for attempt in $(seq 60); do\n"
                   "  sleep 0.5\n"
                   "  import -window root after.png\n"
                   "  [ \"$(identify -format %k after.png)\" -gt 100 ] && break\n"
                   "done\n"
                   "kill $viewer\n");
  const tool::Outcome viewer = runUnderX({"sh", "view.sh"});
  ASSERT_EQ(viewer.status, 0) << viewer.err << tool::readText(path("viewer.log"));
  const Pixels before = countPixels(path("before.png")), after = countPixels(path("after.png"));
  EXPECT_EQ(before.skin + before.blue, 0);
  // The sphere covers about a tenth of the screen.
  EXPECT_GT(after.skin, .02 * after.all) << tool::readText(path("viewer.log"));
  EXPECT_GT(after.blue, .01 * after.all);
}

} // namespace
