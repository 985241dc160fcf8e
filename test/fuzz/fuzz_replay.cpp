// SPDX-License-Identifier: BSD-3-Clause
// Replays the corpus and a fixed sequence of mutations of it through every reader, in seconds, without a fuzzer.
//   fuzz_replay CORPUS DICTIONARY [MUTATIONS]
// Counts memory, if not under sanitizers: no file may make a reader take more than a small multiple of the file's size.
#include "benchmark/heap.h"
#include "fuzz/readers.h"
#include "support/random.h"

#include <sys/resource.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

namespace {

namespace fs = std::filesystem;

std::string readFile(const fs::path& path)
{
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

/// The words between quotes of a libFuzzer dictionary.
std::vector<std::string> readDictionary(const std::string& path)
{
  std::vector<std::string> words;
  std::istringstream lines(readFile(path));
  for (std::string line; std::getline(lines, line);) {
    const std::size_t begin = line.find('"'), end = line.rfind('"');
    if (begin != std::string::npos && end > begin + 1 && line[0] != '#')
      words.push_back(line.substr(begin + 1, end - begin - 1));
  }
  return words;
}

/// Makes a mutated file out of others; the same seed gives the same files.
class Mutator {
public:
  Mutator(const std::vector<std::string>& corpus, const std::vector<std::string>& words, std::uint64_t seed)
      : corpus_(corpus), words_(words), random_(seed)
  {}

  std::string next()
  {
    std::string bytes = corpus_[random_.index(corpus_.size())];
    for (std::size_t left = 1 + random_.index(4); left > 0; --left)
      mutate(bytes);
    return bytes;
  }

private:
  void mutate(std::string& bytes)
  {
    const std::size_t at = random_.index(bytes.size() + 1),
                      length = random_.index(std::min<std::size_t>(bytes.size() - at, 40) + 1);
    switch (random_.index(8)) {
    case 0: // another byte
      if (at < bytes.size())
        bytes[at] = static_cast<char>(random_.index(256));
      break;
    case 1: // a bit
      if (at < bytes.size())
        bytes[at] = static_cast<char>(bytes[at] ^ (1 << random_.index(8)));
      break;
    case 2:
      bytes.erase(at, length);
      break;
    case 3:
      bytes.insert(random_.index(bytes.size() + 1), bytes.substr(at, length));
      break;
    case 4: // the end
      if (random_.index(4) == 0)
        bytes.resize(at);
      break;
    case 5:
      bytes.insert(at, words_[random_.index(words_.size())]);
      break;
    case 6:
      replaceNumber(bytes, at);
      break;
    default: // the rest of another file
      const std::string& other = corpus_[random_.index(corpus_.size())];
      bytes = bytes.substr(0, at) + other.substr(random_.index(other.size() + 1));
    }
  }

  void replaceNumber(std::string& bytes, std::size_t from)
  {
    static const std::vector<std::string> numbers = {
        "0",     "1",   "-1",  "2147483647", "2147483648", "4294967295", "18446744073709551615",
        "1e300", "nan", "inf", "65536"};
    const std::size_t begin = bytes.find_first_of("0123456789", from);
    if (begin == std::string::npos)
      return;
    const std::size_t end = std::min(bytes.find_first_not_of("0123456789", begin), bytes.size());
    bytes.replace(begin, end - begin, numbers[random_.index(numbers.size())]);
  }

  const std::vector<std::string>& corpus_;
  const std::vector<std::string>& words_;
  clouds::Random random_;
};

/// \return true if the file was read; ends the process if the reader misbehaves
bool run(const fuzz::Reader& reader, const std::string& bytes)
{
  // What is there for every file: messages and buffers.
  constexpr std::size_t always = std::size_t{1} << 20;
  const std::int64_t before = benchmarks::heapBytes();
  benchmarks::resetPeak();
  std::string fault;
  bool wasRead = false;
  try {
    wasRead = fuzz::runReader(reader, bytes);
  } catch (const std::exception& error) {
    fault = error.what();
  }
  const auto taken = static_cast<std::size_t>(benchmarks::peakBytes() - before);
  if (fault.empty() && taken > always + reader.largestRatio * bytes.size())
    fault = "too much memory";
  if (fault.empty())
    return wasRead;
  const std::string name = std::string("failed-") + reader.name;
  std::ofstream(name, std::ios::binary) << bytes;
  std::fprintf(stderr, "%s: %s on %zu bytes, with at most %zu of memory; the file is in %s\n", reader.name,
               fault.c_str(), bytes.size(), taken, name.c_str());
  std::exit(1);
}

bool replay(const fuzz::Reader& reader, const std::string& folder, const std::vector<std::string>& words, int mutations)
{
  std::vector<fs::path> paths;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder))
    if (entry.path().filename().string().rfind(std::string(reader.name) + "-", 0) == 0)
      paths.push_back(entry.path());
  std::sort(paths.begin(), paths.end());
  std::vector<std::string> corpus;
  int read = 0;
  for (const fs::path& path : paths) {
    corpus.push_back(readFile(path));
    const bool isBad = path.filename().string().find("-bad-") != std::string::npos;
    const bool wasRead = run(reader, corpus.back());
    if (wasRead == isBad) {
      std::fprintf(stderr, "%s was %s\n", path.c_str(), wasRead ? "read" : "refused");
      return false;
    }
    read += wasRead;
  }
  if (read == 0) {
    std::fprintf(stderr, "%s: the corpus has no file for it\n", reader.name);
    return false;
  }
  constexpr std::uint64_t seed = 20100427;
  Mutator mutator(corpus, words, seed);
  int mutantsRead = 0;
  for (int i = 0; i < mutations; ++i)
    mutantsRead += run(reader, mutator.next());
  std::printf("%-10s %zu files, %d read; %d mutations, %d read\n", reader.name, corpus.size(), read, mutations,
              mutantsRead);
  return true;
}

} // namespace

int main(int argc, char** argv)
{
  if (argc < 3) {
    std::fprintf(stderr, "usage: fuzz_replay CORPUS DICTIONARY [MUTATIONS]\n");
    return 2;
  }
  constexpr rlimit memory{rlim_t{4} << 30, rlim_t{4} << 30}; // so that no fault takes all of the machine's
  if (benchmarks::heapBytes() > 0)                           // sanitizers reserve terabytes
    setrlimit(RLIMIT_AS, &memory);
  const std::vector<std::string> words = readDictionary(argv[2]);
  const int mutations = argc > 3 ? std::atoi(argv[3]) : 20000;
  bool good = !words.empty();
  for (const fuzz::Reader& reader : fuzz::readers())
    good = replay(reader, argv[1], words, mutations) && good;
  return good ? 0 : 1;
}
