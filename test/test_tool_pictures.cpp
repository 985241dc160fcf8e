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
    // Shading scales the channels; what tells the two colours apart is which one leads, and clearly.
    pixels.skin += rgb[0] > 40 && rgb[0] > 1.15 * rgb[2];
    pixels.blue += rgb[2] > 40 && rgb[2] > 1.5 * rgb[0];
    pixels.light += std::min({rgb[0], rgb[1], rgb[2]}) > 200;
  }
  return pixels;
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

TEST_F(ToolPictures, ShowsTheSurfaceWithItsColours)
{
  const tool::Outcome outcome = runUnderX(
      {MRF_TOOL, "sphere.xyz", "out.ply", "--colour", "confidence", "--max-hole", "5", "--picture", "out.png"});
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

TEST_F(ToolPictures, PclViewerShowsAColouredSurface)
{
  if (!tool::hasProgram("pcl_viewer") || !tool::hasProgram("import"))
    GTEST_SKIP() << "pcl_viewer or ImageMagick's import is not installed";
  struct View {
    std::string input, camera;
    bool hole;
  };
  // pcl_viewer looks at a mesh from a fixed place, mostly inside it.
  std::vector<View> views = {{"sphere.xyz", "0.1,20/0,0,0/4,0,4/0,1,0/0.6/700,500/0,0", true}};
  const std::string bunny = "/usr/share/glmark2/models/bunny.obj";
  if (std::filesystem::exists(bunny))
    views.push_back({bunny, "0.1,20/0,0,0/0,0,6/0,1,0/0.5/700,500/0,0", false});
  for (const View& view : views) {
    SCOPED_TRACE(view.input);
    const tool::Outcome outcome = run({view.input, "out.vtk", "--colour", "confidence", "--max-hole", "5", "-q"});
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    // The empty screen first: the counts below must come from the viewer. It draws some time after its start.
    write("view.sh", "import -window root before.png\n"
                     "pcl_viewer -cam " +
                         view.camera +
                         " out.vtk >viewer.log 2>&1 &\n"
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
    // The objects cover about a tenth of the screen.
    EXPECT_GT(after.skin, .02 * after.all) << tool::readText(path("viewer.log"));
    if (view.hole) {
      EXPECT_GT(after.blue, .01 * after.all);
    }
  }
}

} // namespace
