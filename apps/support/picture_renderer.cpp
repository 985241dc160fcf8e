// SPDX-License-Identifier: BSD-3-Clause
#include "picture_renderer.h"

#include "poly_data.h"
#include "errors.h"

#include <Eigen/Geometry>

#include <vtkActor.h>
#include <vtkCamera.h>
#include <vtkLight.h>
#include <vtkLightKit.h>
#include <vtkLookupTable.h>
#include <vtkPNGWriter.h>
#include <vtkPointData.h>
#include <vtkPolyDataMapper.h>
#include <vtkProperty.h>
#include <vtkRenderer.h>
#include <vtkRenderWindow.h>
#include <vtkScalarBarActor.h>
#include <vtkTextActor.h>
#include <vtkTextProperty.h>
#include <vtkUnsignedCharArray.h>
#include <vtkWindowToImageFilter.h>

#include <X11/Xlib.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace mrf_apps {
namespace {

void setStyle(vtkTextProperty& text, int pictureHeight)
{
  text.SetColor(.15, .15, .15);
  text.SetFontSize(std::max(10, pictureHeight / 38));
  text.SetFontFamilyToArial();
  text.BoldOff();
  text.ItalicOff();
  text.ShadowOff();
}

vtkSmartPointer<vtkRenderer> makeLegend(const Legend& legend, int pictureHeight)
{
  auto renderer = vtkSmartPointer<vtkRenderer>::New();
  renderer->SetBackground(1, 1, 1);
  renderer->SetViewport(0, 0, 1, legendHeight);
  auto table = vtkSmartPointer<vtkLookupTable>::New();
  table->SetNumberOfTableValues(static_cast<vtkIdType>(legend.colors.size()));
  table->SetRange(legend.lower, legend.upper);
  for (std::size_t i = 0; i < legend.colors.size(); ++i) {
    const auto& [red, green, blue] = legend.colors[i];
    table->SetTableValue(static_cast<vtkIdType>(i), red / 255., green / 255., blue / 255.);
  }
  auto bar = vtkSmartPointer<vtkScalarBarActor>::New();
  bar->SetLookupTable(table);
  bar->SetOrientationToHorizontal();
  bar->SetNumberOfLabels(5);
  bar->SetLabelFormat("%.3g");
  bar->UnconstrainedFontSizeOn();
  setStyle(*bar->GetLabelTextProperty(), pictureHeight);
  bar->SetBarRatio(.45);
  bar->SetPosition(.2, .08);
  bar->SetWidth(.6);
  bar->SetHeight(.55);
  renderer->AddActor2D(bar);

  // The bar's own title overlaps its labels.
  auto title = vtkSmartPointer<vtkTextActor>::New();
  title->SetInput(legend.title.c_str());
  setStyle(*title->GetTextProperty(), pictureHeight);
  title->GetTextProperty()->SetJustificationToCentered();
  title->GetPositionCoordinate()->SetCoordinateSystemToNormalizedViewport();
  title->GetPositionCoordinate()->SetValue(.5, .7);
  renderer->AddActor2D(title);
  return renderer;
}

/// How far from the focus a camera has to stand to have all vertices in its picture, with a small margin.
/// \param from unit, where it stands \param viewAngle degrees from bottom to top \param aspect width over height
double fittingDistance(const std::vector<Eigen::Vector3d>& vertices, const Eigen::Vector3d& focus,
                       const Eigen::Vector3d& from, const Eigen::Vector3d& up, double viewAngle, double aspect)
{
  constexpr double filled = .94;
  const double slope = filled * std::tan(viewAngle * M_PI / 360);
  const Eigen::Vector3d right = up.cross(from).normalized(), above = from.cross(right);
  double distance = 0;
  for (const Eigen::Vector3d& vertex : vertices) {
    const Eigen::Vector3d x = vertex - focus;
    const double across = std::max(std::abs(x.dot(above)), std::abs(x.dot(right)) / aspect);
    distance = std::max(distance, x.dot(from) + across / slope);
  }
  return distance;
}

void setCamera(const PictureOptions& options, const Eigen::Vector3d& viewpoint, vtkCamera& camera)
{
  camera.SetPosition(viewpoint.data());
  camera.SetFocalPoint(Eigen::Vector3d(viewpoint + options.sight).data());
  camera.SetViewUp(options.up.data());
  camera.SetViewAngle(options.viewAngle);
}

void checkDisplay()
{
  const char* remedy = "; put 'xvfb-run -a' in front of the command";
  const char* name = std::getenv("DISPLAY");
  if (name == nullptr || *name == '\0')
    throw FileError(std::string("a picture needs an X display, and DISPLAY is not set") + remedy);
  // VTK ends the process when the server does not answer.
  Display* display = XOpenDisplay(nullptr);
  if (display == nullptr)
    throw FileError("a picture needs an X display, and '" + std::string(name) + "' does not answer" + remedy);
  XCloseDisplay(display);
}

std::string renderPicture(const SurfaceMesh& mesh, const PictureOptions& options)
{
  // Far from the origin the graphics card's floats would show.
  SurfaceMesh centered = mesh;
  Eigen::Vector3d lower = mesh.vertices.front(), upper = lower;
  for (const Eigen::Vector3d& vertex : mesh.vertices) {
    lower = lower.cwiseMin(vertex);
    upper = upper.cwiseMax(vertex);
  }
  for (Eigen::Vector3d& vertex : centered.vertices)
    vertex -= (lower + upper) / 2;
  centered.doublePrecision = false;

  auto mapper = vtkSmartPointer<vtkPolyDataMapper>::New();
  mapper->SetInputData(toPolyData(centered));
  mapper->SetScalarVisibility(!mesh.colors.empty());
  auto actor = vtkSmartPointer<vtkActor>::New();
  actor->SetMapper(mapper);
  actor->GetProperty()->SetColor(.80, .78, .74);
  actor->GetProperty()->SetInterpolationToPhong();
  actor->GetProperty()->SetSpecular(.15);
  actor->GetProperty()->SetSpecularPower(25);
  if (options.showEdges) {
    actor->GetProperty()->EdgeVisibilityOn();
    actor->GetProperty()->SetEdgeColor(.15, .17, .2);
    // Facets show what the edges are about; smooth shading would hide it.
    actor->GetProperty()->SetInterpolationToFlat();
  }

  auto renderer = vtkSmartPointer<vtkRenderer>::New();
  renderer->SetBackground(1, 1, 1);
  renderer->SetBackground2(.86, .89, .93);
  renderer->GradientBackgroundOn();
  renderer->AddActor(actor);
  auto lights = vtkSmartPointer<vtkLightKit>::New();
  lights->SetKeyLightIntensity(.95);
  lights->SetKeyToFillRatio(2.5);
  lights->AddLightsToRenderer(renderer);

  const Eigen::Vector3d extent = upper - lower;
  Eigen::Vector3d from = options.from, up = options.up;
  if (from.isZero(0)) {
    // A relief whose y is its depth is seen from above.
    if (extent.y() < .3 * std::min(extent.x(), extent.z())) {
      from = {.25, 1, -.45};
      up = Eigen::Vector3d::UnitZ();
      if (extent.z() > extent.x())
        from.z() = -from.z();
    } else
      from = {.35, .3, 1};
  }
  vtkCamera* camera = renderer->GetActiveCamera();
  constexpr double viewAngle = 25;
  const Eigen::Vector3d focus =
      options.focus ? Eigen::Vector3d(*options.focus - (lower + upper) / 2) : Eigen::Vector3d(0, 0, 0);
  camera->SetFocalPoint(focus.data());
  camera->SetViewUp(up.data());
  camera->SetViewAngle(viewAngle);
  if (options.viewpoint)
    setCamera(options, *options.viewpoint - (lower + upper) / 2, *camera);
  else if (options.extent > 0) {
    const double distance = .5 * options.extent / std::tan(viewAngle * M_PI / 360);
    camera->SetPosition(Eigen::Vector3d(focus + distance * from.normalized()).data());
  } else {
    const double legend = options.legend.colors.empty() ? 0 : legendHeight;
    const double aspect = options.width / (options.height * (1 - legend));
    const double distance = fittingDistance(centered.vertices, focus, from.normalized(), up, viewAngle, aspect);
    camera->SetPosition(Eigen::Vector3d(focus + distance * from.normalized()).data());
  }

  auto window = vtkSmartPointer<vtkRenderWindow>::New();
  window->SetOffScreenRendering(1);
  window->SetMultiSamples(8);
  window->SetSize(options.width, options.height);
  window->AddRenderer(renderer);
  if (!options.legend.colors.empty()) {
    renderer->SetViewport(0, legendHeight, 1, 1);
    window->AddRenderer(makeLegend(options.legend, options.height));
  }
  renderer->ResetCameraClippingRange();
  window->Render();
  auto image = vtkSmartPointer<vtkWindowToImageFilter>::New();
  image->SetInput(window);
  image->ReadFrontBufferOff();
  image->Update();
  auto writer = vtkSmartPointer<vtkPNGWriter>::New();
  writer->SetInputData(image->GetOutput());
  writer->WriteToMemoryOn();
  writer->Write();
  vtkUnsignedCharArray& bytes = *writer->GetResult();
  return {reinterpret_cast<const char*>(bytes.GetPointer(0)), static_cast<std::size_t>(bytes.GetNumberOfValues())};
}

} // namespace

extern "C" __attribute__((visibility("default"))) const PictureRenderer pictureRenderer = {checkDisplay, renderPicture};

} // namespace mrf_apps
