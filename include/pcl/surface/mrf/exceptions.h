// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief The errors of the module: one type per kind of failure, all derived from pcl::PCLException.
#pragma once

#include <pcl/exceptions.h>
#include <pcl/surface/mrf/export.h>

#include <exception>
#include <new>
#include <string>

namespace pcl::mrf {

/// How a reconstruction ended. An error comes with a message that names the value and the remedy.
enum class Status {
  notRun,
  ok,
  invalidInput,
  invalidOption,
  resourceLimit,
  solverFailure,
  cancelled,
  callerError,  ///< a callback or a search object of the caller threw an exception
  internalError ///< any other exception
};

/// \return the status as a word for reports: "ok", "invalid input", ...
PCL_MRF_EXPORT const char* toString(Status status);

/// Base of all errors thrown by the stages.
class PCL_MRF_EXPORT Error : public pcl::PCLException {
public:
  Error(Status status, const std::string& message) : pcl::PCLException(message), status_(status), message_(message) {}
  Status status() const { return status_; }
  const std::string& message() const { return message_; }
  const char* what() const noexcept override { return message_.c_str(); }

private:
  Status status_;
  std::string message_; ///< without the place of the throw, which PCL's own message has
};

/// The cloud cannot be reconstructed: too few points, no usable normals, no zero level, ...
class PCL_MRF_EXPORT InvalidInput : public Error {
public:
  explicit InvalidInput(const std::string& message) : Error(Status::invalidInput, message) {}
};

/// An option is outside its range; the message carries the option's name, its value and the range.
class PCL_MRF_EXPORT InvalidOption : public Error {
public:
  explicit InvalidOption(const std::string& message) : Error(Status::invalidOption, message) {}
};

/// The predicted memory exceeds the limit; the message names the voxel size that would fit.
class PCL_MRF_EXPORT ResourceLimit : public Error {
public:
  explicit ResourceLimit(const std::string& message) : Error(Status::resourceLimit, message) {}
};

/// A solver broke down or gave a field that is not finite.
class PCL_MRF_EXPORT SolverFailure : public Error {
public:
  explicit SolverFailure(const std::string& message) : Error(Status::solverFailure, message) {}
};

/// The progress callback asked to stop.
class PCL_MRF_EXPORT Cancelled : public Error {
public:
  explicit Cancelled(const std::string& message) : Error(Status::cancelled, message) {}
};

/// A callback or a search object of the caller threw an exception. The message has its text; the exception is nested.
class PCL_MRF_EXPORT CallerError : public Error, public std::nested_exception {
public:
  explicit CallerError(const std::string& message) : Error(Status::callerError, message) {}
};

/// Rethrows the current exception as a CallerError. \param what its source, such as "the progress callback"
[[noreturn]] PCL_MRF_EXPORT void throwCallerError(const char* what);

/// Calls a callback or an object of the caller. \param what its name in the message
/// \throw CallerError if the call throws; errors of the module and std::bad_alloc pass unchanged
template <typename Call>
auto callHandedIn(const char* what, const Call& call) -> decltype(call())
{
  try {
    return call();
  } catch (const Error&) {
    throw;
  } catch (const std::bad_alloc&) {
    throw;
  } catch (...) {
    throwCallerError(what);
  }
}

/// A file cannot be written; the message says why.
class PCL_MRF_EXPORT FileError : public pcl::IOException {
public:
  explicit FileError(const std::string& message) : pcl::IOException(message), message_(message) {}
  const char* what() const noexcept override { return message_.c_str(); }

private:
  std::string message_;
};

} // namespace pcl::mrf
