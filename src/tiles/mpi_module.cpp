// SPDX-License-Identifier: BSD-3-Clause
// libpcl_mrf_mpi: message passing by MPI, for the library that loads it.
#include "tiles/message_passing.h"

#include <mpi.h>

#include <algorithm>

namespace pcl::mrf {
namespace {

/// Max bytes of a block. MPI counts bytes by 32-bit numbers, so that a message is sent as a head and some blocks.
constexpr std::uint64_t blockBytes = std::uint64_t{1} << 30;
constexpr int headTag = 1, blockTag = 2;

struct Head {
  std::uint64_t tag, bytes;
};

/// Calls body(offset, bytes) for the blocks of a message.
template <typename Body>
void forBlocks(std::uint64_t count, const Body& body)
{
  for (std::uint64_t done = 0; done < count; done += blockBytes)
    body(done, static_cast<int>(std::min(blockBytes, count - done)));
}

void send(std::int32_t to, std::int32_t tag, const void* bytes, std::uint64_t count)
{
  const Head head{static_cast<std::uint64_t>(tag), count};
  MPI_Send(&head, sizeof(head), MPI_BYTE, to, headTag, MPI_COMM_WORLD);
  forBlocks(count, [&](std::uint64_t offset, int size) {
    MPI_Send(static_cast<const char*>(bytes) + offset, size, MPI_BYTE, to, blockTag, MPI_COMM_WORLD);
  });
}

std::int32_t probe(Message* message)
{
  int isThere = 0;
  MPI_Status status;
  MPI_Iprobe(MPI_ANY_SOURCE, headTag, MPI_COMM_WORLD, &isThere, &status);
  if (isThere == 0)
    return 0;
  Head head;
  MPI_Recv(&head, sizeof(head), MPI_BYTE, status.MPI_SOURCE, headTag, MPI_COMM_WORLD, MPI_STATUS_IGNORE);
  *message = {status.MPI_SOURCE, static_cast<std::int32_t>(head.tag), head.bytes};
  return 1;
}

void receive(const Message* message, void* bytes)
{
  forBlocks(message->bytes, [&](std::uint64_t offset, int size) {
    MPI_Recv(static_cast<char*>(bytes) + offset, size, MPI_BYTE, message->from, blockTag, MPI_COMM_WORLD,
             MPI_STATUS_IGNORE);
  });
}

void finish()
{
  MPI_Finalize();
}

} // namespace
} // namespace pcl::mrf

extern "C" __attribute__((visibility("default"))) const pcl::mrf::MessagePassing* pcl_mrf_mpi_1()
{
  static pcl::mrf::MessagePassing passing{
      0, 1, 1, pcl::mrf::send, pcl::mrf::probe, pcl::mrf::receive, pcl::mrf::finish};
  if (MPI_Init(nullptr, nullptr) != MPI_SUCCESS)
    return nullptr;
  MPI_Comm machine = MPI_COMM_NULL;
  MPI_Comm_rank(MPI_COMM_WORLD, &passing.rank);
  MPI_Comm_size(MPI_COMM_WORLD, &passing.ranks);
  MPI_Comm_split_type(MPI_COMM_WORLD, MPI_COMM_TYPE_SHARED, passing.rank, MPI_INFO_NULL, &machine);
  MPI_Comm_size(machine, &passing.ranksOfMachine);
  MPI_Comm_free(&machine);
  return &passing;
}
