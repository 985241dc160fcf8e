// SPDX-License-Identifier: BSD-3-Clause
#include "picture.h"

#include "errors.h"
#include "float_offset.h"
#include "poly_data.h"

#include <vtkActor.h>
#include <vtkCamera.h>
#include <vtkLight.h>
#include <vtkLightKit.h>
#include <vtkPNGWriter.h>
#include <vtkPointData.h>
#include <vtkPolyDataMapper.h>
#include <vtkProperty.h>
#include <vtkRenderer.h>
#include <vtkRenderWindow.h>
#include <vtkUnsignedCharArray.h>
#include <vtkWindowToImageFilter.h>

#include <X11/Xlib.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace mrf_apps {
namespace {

constexpr int side = 1000; ///< width and height of a picture, pixels

/// The distance from the origin at which a camera sees all vertices, with a small margin.
/// \param from unit direction to the camera \param viewAngle degrees from bottom to top
double fittingDistance(const std::vector<Eigen::Vector3d>& vertices, const Eigen::Vector3d& from,
                       const Eigen::Vector3d& up, double viewAngle)
{
  constexpr double filled = .94;
  const double slope = filled * std::tan(viewAngle * M_PI / 360);
  const Eigen::Vector3d right = up.cross(from).normalized(), above = from.cross(right);
  double distance = 0;
  for (const Eigen::Vector3d& x : vertices) {
    const double across = std::max(std::abs(x.dot(above)), std::abs(x.dot(right)));
    distance = std::max(distance, x.dot(from) + across / slope);
  }
  return distance;
}

/// \param vertices centered on the origin \param offset from the mesh's frame to that of the vertices
void setCamera(const PictureOptions& options, const std::vector<Eigen::Vector3d>& vertices,
               const Eigen::Vector3d& offset, vtkCamera& camera)
{
  const Eigen::Vector3d position =
      options.viewpoint ? Eigen::Vector3d(*options.viewpoint + offset)
                        : fittingDistance(vertices, -options.sight, options.up, options.viewAngle) * -options.sight;
  const Eigen::Vector3d focus = position + options.sight;
  camera.SetPosition(position.data());
  camera.SetFocalPoint(focus.data());
  camera.SetViewUp(options.up.data());
  camera.SetViewAngle(options.viewAngle);
}

void checkDisplay()
{
  const char* remedy = "; put 'xvfb-run -a' in front of the command (Debian package xvfb)";
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
  // Centered, because the graphics card's floats are too coarse far from the origin.
  SurfaceMesh centered = mesh;
  const Eigen::Vector3d middle = boxOf(mesh.vertices).center();
  for (Eigen::Vector3d& vertex : centered.vertices)
    vertex -= middle;
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

  auto renderer = vtkSmartPointer<vtkRenderer>::New();
  renderer->SetBackground(1, 1, 1);
  renderer->SetBackground2(.86, .89, .93);
  renderer->GradientBackgroundOn();
  renderer->AddActor(actor);
  auto lights = vtkSmartPointer<vtkLightKit>::New();
  lights->SetKeyLightIntensity(.95);
  lights->SetKeyToFillRatio(2.5);
  lights->AddLightsToRenderer(renderer);

  setCamera(options, centered.vertices, -middle, *renderer->GetActiveCamera());

  auto window = vtkSmartPointer<vtkRenderWindow>::New();
  window->SetOffScreenRendering(1);
  window->SetMultiSamples(8);
  window->SetSize(side, side);
  window->AddRenderer(renderer);
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
