// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief VTK's writers with errors as exceptions.
#pragma once

#include "errors.h"

#include <vtkErrorCode.h>
#include <vtkObject.h>

#include <string>

namespace mrf_apps {

/// Writes a data set; VTK prints nothing. \throw FileError
template <typename Writer, typename Data>
void writeThroughVtk(Writer& writer, const Data& data, const std::string& path)
{
  vtkObject::GlobalWarningDisplayOff();
  writer.SetFileName(path.c_str());
  writer.SetInputData(data);
  writer.Write();
  const unsigned long code = writer.GetErrorCode();
  vtkObject::GlobalWarningDisplayOn();
  if (code == vtkErrorCode::NoError)
    return;
  // VTK takes the system's error of whatever was called last for its own; OutputFiles::write finds the cause.
  const bool isOfVtk = code >= vtkErrorCode::FirstVTKErrorCode;
  throw FileError("could not be written" +
                  (isOfVtk ? std::string(": ") + vtkErrorCode::GetStringFromErrorCode(code) : std::string()));
}

} // namespace mrf_apps
