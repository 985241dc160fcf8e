// SPDX-License-Identifier: BSD-3-Clause
/// Parts of a run as tasks, which are done here at once or by a TaskRunner: their inputs and results are bytes, by
/// Boost's archives, in the format of this kind of machine.
///
/// A type has its serialize(archive, value, version) beside it. A type with padding is written member by member:
/// padding differs from run to run, and the checksum of a task's input names the task.
#pragma once

#include "field/voxel_set.h"

#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/lattice.h>

#include <boost/archive/binary_iarchive.hpp>
#include <boost/archive/binary_oarchive.hpp>
#include <boost/iostreams/device/array.hpp>
#include <boost/iostreams/device/back_inserter.hpp>
#include <boost/iostreams/stream.hpp>
#include <boost/serialization/array.hpp>
#include <boost/serialization/is_bitwise_serializable.hpp>
#include <boost/serialization/vector.hpp>
#include <Eigen/Core>

#include <array>
#include <cstdint>
#include <string>
#include <utility>

BOOST_IS_BITWISE_SERIALIZABLE(Eigen::Vector3f)
BOOST_IS_BITWISE_SERIALIZABLE(pcl::mrf::Run)

namespace boost {
namespace serialization {
template <>
struct is_bitwise_serializable<std::array<std::int32_t, 3>> : mpl::true_ {};
} // namespace serialization
} // namespace boost

namespace Eigen {
template <typename Archive>
void serialize(Archive& archive, Vector3d& vector, unsigned)
{
  archive& boost::serialization::make_array(vector.data(), 3);
}
} // namespace Eigen

namespace pcl::mrf {

/// Some values, one after the other.
template <typename Archive, typename... Values>
void serializeAll(Archive& archive, Values&... values)
{
  (void)(archive & ... & values);
}

template <typename Archive>
void serialize(Archive& archive, GridSize& size, unsigned)
{
  serializeAll(archive, size.x, size.y, size.z);
}

template <typename Archive>
void serialize(Archive& archive, Lattice& lattice, unsigned)
{
  serializeAll(archive, lattice.size, lattice.origin, lattice.spacing);
}

template <typename Archive>
void serialize(Archive& archive, AxisOrder& order, unsigned)
{
  archive& boost::serialization::make_array(order.axes.data(), order.axes.size());
}

constexpr unsigned archiveFlags = boost::archive::no_header;

template <typename Value>
std::string toBytes(const Value& value)
{
  std::string bytes;
  boost::iostreams::stream<boost::iostreams::back_insert_device<std::string>> stream(bytes);
  boost::archive::binary_oarchive(stream, archiveFlags) << value;
  stream.flush();
  return bytes;
}

template <typename Value>
Value fromBytes(const std::string& bytes)
{
  boost::iostreams::stream<boost::iostreams::array_source> stream(bytes.data(), bytes.size());
  Value value;
  boost::archive::binary_iarchive(stream, archiveFlags) >> value;
  return value;
}

/// The function of a kind of task. \tparam Input, Output have serialize()
template <typename Input, typename Output>
using Task = Output(Input input, Execution& execution);

/// Does `count` tasks: use(n, task(makeInput(n))) for each n in turn.
/// \param kind under which doTask() of tiles/do_task.h knows the task \throw what a task throws; what TaskRunner::run
/// does
template <typename Input, typename Output, typename MakeInput, typename Use>
void forTasks(const char* kind, Task<Input, Output>* task, int count, const MakeInput& makeInput, const Use& use,
              Execution& execution)
{
  if (TaskRunner* const runner = execution.tasks())
    return runner->run(
        kind, count, [&](int n) { return toBytes(static_cast<const Input&>(makeInput(n))); },
        [&](int n, std::string result) { use(n, fromBytes<Output>(std::exchange(result, {}))); }, execution);
  for (int n = 0; n < count; ++n)
    use(n, task(makeInput(n), execution));
}

/// Does a task from bytes to bytes. The bytes of the input are freed before it begins.
template <typename Input, typename Output>
std::string doneAsBytes(Task<Input, Output>* task, std::string input, Execution& execution)
{
  auto value = fromBytes<Input>(input);
  std::string().swap(input);
  return toBytes(task(std::move(value), execution));
}

} // namespace pcl::mrf
