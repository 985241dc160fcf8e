// SPDX-License-Identifier: BSD-3-Clause
/// What the library asks of libpcl_mrf_mpi, the module that stands between it and MPI.
///
/// The library loads the module while it runs, and does without it on one machine. Only types of C cross the border.
#pragma once

#include <cstdint>

namespace pcl::mrf {

/// A message that has come and is to be received.
struct Message {
  std::int32_t from, tag; ///< rank; what it is
  std::uint64_t bytes;
};

/// Functions for one thread. What fails ends all ranks, as MPI does unless it is told otherwise.
struct MessagePassing {
  std::int32_t rank, ranks;
  std::int32_t ranksOfMachine; ///< on this rank's, itself included
  void (*send)(std::int32_t to, std::int32_t tag, const void* bytes, std::uint64_t count);
  std::int32_t (*probe)(Message* message); ///< whether one has come, from anyone; then receive it next
  void (*receive)(const Message* message, void* bytes);
  void (*finish)(); ///< when no rank has anything to say any more
};

/// Begins; null if MPI cannot be begun. What is returned stays the module's.
using BeginMessagePassing = const MessagePassing*();

/// The module's only name, a BeginMessagePassing; it changes with what is above.
constexpr const char* messagePassingSymbol = "pcl_mrf_mpi_1";

} // namespace pcl::mrf
