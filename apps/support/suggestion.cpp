// SPDX-License-Identifier: BSD-3-Clause
#include "suggestion.h"

#include <algorithm>

namespace mrf_apps {
namespace {

/// Fewest insertions, deletions, changes and swaps of neighbors that make one word the other.
std::size_t editDistance(const std::string& a, const std::string& b)
{
  // Row i holds the distances of the first i letters of a from the beginnings of b.
  std::vector<std::vector<std::size_t>> distance(a.size() + 1, std::vector<std::size_t>(b.size() + 1));
  for (std::size_t i = 0; i <= a.size(); ++i)
    for (std::size_t j = 0; j <= b.size(); ++j) {
      std::size_t& best = distance[i][j];
      if (i == 0 || j == 0) {
        best = i + j;
        continue;
      }
      best = std::min(
          {distance[i - 1][j] + 1, distance[i][j - 1] + 1, distance[i - 1][j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1)});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
        best = std::min(best, distance[i - 2][j - 2] + 1);
    }
  return distance[a.size()][b.size()];
}

std::size_t lettersOf(const std::string& word)
{
  return static_cast<std::size_t>(std::count_if(word.begin(), word.end(), [](char c) { return c != '-'; }));
}

} // namespace

std::string nearestWord(const std::string& word, const std::vector<std::string>& candidates)
{
  constexpr std::size_t longestWord = 100; // nobody mistypes a longer one, and the time grows with its square
  const std::size_t letters = lettersOf(word);
  if (letters == 0 || word.size() > longestWord)
    return {};
  std::string best;
  std::size_t min = letters / 3 + 1;
  for (const std::string& candidate : candidates) {
    if (letters > 1 && candidate.compare(0, word.size(), word) == 0)
      return candidate;
    const std::size_t edits = editDistance(word, candidate);
    if (edits < min) {
      min = edits;
      best = candidate;
    }
  }
  return best;
}

std::string didYouMean(const std::string& word, const std::vector<std::string>& candidates)
{
  const std::string nearest = nearestWord(word, candidates);
  return nearest.empty() ? "" : "; did you mean " + nearest + "?";
}

} // namespace mrf_apps
