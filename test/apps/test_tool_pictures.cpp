// SPDX-License-Identifier: BSD-3-Clause
// Pictures, checked by their pixels.
#include "support/tool.h"

#include <vtkDataArray.h>
#include <vtkImageData.h>
#include <vtkPNGReader.h>
#include <vtkPointData.h>
#include <vtkSmartPointer.h>

#include <algorithm>
#include <cmath>

namespace {

/// The pixels of a picture by what they show.
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
    const double* const rgb = image->GetPointData()->GetScalars()->GetTuple3(i);
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
/// \param turn about an axis through its middle along x, degrees
std::string planeBeforeCamera(double height = 1, double turn = 0)
{
  constexpr int side = 40;
  const double c = std::cos(turn * M_PI / 180), s = std::sin(turn * M_PI / 180);
  std::string text = "ply\nformat ascii 1.0\nelement vertex " + std::to_string(side * side) + "\n";
  for (const char* name : {"x", "y", "z", "nx", "ny", "nz"})
    text += "property float " + std::string(name) + "\n";
  for (const char* name : {"red", "green", "blue"})
    text += "property uchar " + std::string(name) + "\n";
  text += "end_header\n";
  for (int i = 0; i < side * side; ++i) {
    const double x = (i % side + .5) / side - .5, y = height * ((i / side + .5) / side - .5);
    for (const double value : {x, c * y, 2 + s * y, 0., s, -c})
      text += std::to_string(value) + " ";
    text += x < 0 && y < 0 ? "220 60 40\n" : "30 60 220\n";
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
    return tool::runProgram(tool::with({"xvfb-run", "-a", "-s", "-screen 0 800x600x24"}, command), path(""));
  }

  /// Of the picture that the tool writes.
  Pixels pictureOf(const std::vector<std::string>& arguments) const
  {
    const tool::Outcome outcome =
        runUnderX(tool::with(tool::with({MRF_TOOL}, arguments), {"-q", "out.ply", "--picture", "out.png"}));
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    return outcome.status == 0 ? countPixels(path("out.png")) : Pixels();
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
  const Pixels pixels = pictureOf({"plane.ply"});
  EXPECT_EQ(pixels.border, 0);
  EXPECT_GT(pixels.skin + pixels.blue, .3 * pixels.all);
}

TEST_F(ToolPictures, LooksFromTheSensor)
{
  write("plane.ply", planeBeforeCamera());
  // In a camera's frame x points to the right and y down: the red quarter is at the upper left. A sensor is at the
  // origin, because the command says so or because all normals look there.
  for (const char* sensor : {"--sensor=0,0,0", "--sensor-origin=on"}) {
    const Pixels camera = pictureOf({"plane.ply", sensor});
    // The plane's corners reach the picture's side, half of a square in a circle; the middle of the quarter is then a
    // quarter of 1/√2 off. The perspective and the rim make a few per cent.
    EXPECT_NEAR(camera.skinRight, -.177, .02) << sensor;
    EXPECT_NEAR(camera.skinUp, .177, .02) << sensor;
    EXPECT_NEAR(static_cast<double>(camera.skin) / camera.all, .125, .02) << sensor;
  }
  // From beside it, somewhat from below what is flat along z: the front, -y, is up.
  const Pixels beside = pictureOf({"plane.ply", "--sensor", "-1,0,-.5"});
  EXPECT_LT(beside.skinRight, -.02);
  EXPECT_GT(beside.skinUp, .02);
  // One as high as is said of airborne scans sees as much as one that is near.
  EXPECT_GT(pictureOf({"plane.ply", "--sensor", "0,0,-1e7"}).blue, 100000);
  // A sensor within the plane cannot see it.
  EXPECT_GT(pictureOf({"plane.ply", "--sensor", "0,0,1.99"}).blue, 100000);
}

TEST_F(ToolPictures, LooksOntoTheFlattestSide)
{
  // It faces -z, and the front, -y, is up: the quarter is at the upper left; from behind it would be at the lower left.
  write("plane.ply", planeBeforeCamera());
  const Pixels straight = pictureOf({"plane.ply", "--sensor-origin", "off"});
  EXPECT_LT(straight.skinRight, -.1);
  EXPECT_GT(straight.skinUp, .1);
  EXPECT_GT(straight.skin + straight.blue, .5 * straight.all);
  EXPECT_EQ(straight.border, 0);
  // Turned by 40 degrees it is flat along no axis of its frame: y is up, and x, seen from behind the frame, to the
  // left.
  write("turned.ply", planeBeforeCamera(1, 40));
  const Pixels turned = pictureOf({"turned.ply", "--sensor-origin", "off"});
  EXPECT_GT(turned.skinRight, .1);
  EXPECT_LT(turned.skinUp, -.1);
  EXPECT_GT(turned.skin + turned.blue, .4 * turned.all);
  // What is closed and little flatter along x is seen from the front, z, where it is blue, rather than along x.
  std::string rows;
  for (const Eigen::Vector3d& p : tool::spherePoints(1500, .3))
    rows += std::to_string(.8 * p.x()) + " " + std::to_string(p.y()) + " " + std::to_string(p.z()) + "\n";
  write("slim.xyz", rows);
  const Pixels slim = pictureOf({"slim.xyz", "--color", "confidence", "--max-hole", "5"});
  EXPECT_GT(slim.blue, slim.skin);
}

TEST_F(ToolPictures, LooksFromWhereTheCommandSays)
{
  // Blue is where z is large, which is the front of what is flat along no axis; the top is y then.
  const std::vector<std::string> sphere = {"sphere.xyz", "--color", "confidence", "--max-hole", "5"};
  const auto sphereFrom = [&](const std::string& camera) {
    return pictureOf(tool::with(sphere, {"--camera", camera}));
  };
  const Pixels front = sphereFrom("front"), back = sphereFrom("back"), behind = sphereFrom("0,0,-2");
  EXPECT_GT(front.blue, .4 * front.all);
  EXPECT_EQ(back.blue, 0);
  EXPECT_GT(back.skin, .4 * back.all);
  EXPECT_EQ(behind.skin, back.skin);
  // From the right the front is to the left, from the left to the right; from the top it is below, from the bottom
  // above.
  EXPECT_GT(sphereFrom("right").skinRight, .02);
  EXPECT_LT(sphereFrom("left").skinRight, -.02);
  EXPECT_GT(sphereFrom("top").skinUp, .02);
  EXPECT_LT(sphereFrom("bottom").skinUp, -.02);

  // In a depth camera's frame the front is where it stands; else what is flat along z is seen from above as the top.
  write("plane.ply", planeBeforeCamera());
  const Pixels camera = pictureOf({"plane.ply", "--camera", "front"});
  EXPECT_NEAR(camera.skinRight, -.235, .02); // a quarter of .94
  EXPECT_NEAR(camera.skinUp, .235, .02);
  const Pixels top = pictureOf({"plane.ply", "--camera", "top", "--sensor-origin", "off"});
  EXPECT_NEAR(top.skinRight, -.235, .02);
  EXPECT_NEAR(top.skinUp, -.235, .02);
}

} // namespace
