// SPDX-License-Identifier: BSD-3-Clause
/// The interface of libpcl_mrf_mpi, the module between the library and MPI.
///
/// The library loads the module at run time; a single process does without it. The interface has only types of C.
#pragma once

#include <cstdint>

namespace pcl::mrf {

/// A message that has come and is to be received.
struct Message {
  std::int32_t from, tag; ///< rank of the sender; kind of message
  std::uint64_t bytes;
};

/// Functions to be called by one thread. An error ends all ranks, as is MPI's default.
struct MessagePassing {
  std::int32_t rank, ranks;
  std::int32_t ranksOfMachine; ///< number of ranks on this rank's machine, itself included
  void (*send)(std::int32_t to, std::int32_t tag, const void* bytes, std::uint64_t count);
  std::int32_t (*probe)(Message* message); ///< 1 if a message has come, from any rank: then receive it next; else 0
  void (*receive)(const Message* message, void* bytes);
  void (*finish)(); ///< to be called when no rank sends anything any more
};

/// Begins message passing. \return an object that the module owns; null if MPI cannot be begun
using BeginMessagePassing = const MessagePassing*();

/// The name of the module's only function, a BeginMessagePassing. Change it whenever the types above change.
constexpr const char* messagePassingSymbol = "pcl_mrf_mpi_1";

} // namespace pcl::mrf
