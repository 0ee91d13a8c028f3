// SPDX-License-Identifier: MIT
// Runs a fuzz target once on each file that is named, or that lies in a folder that is named. For compilers without
// libFuzzer, and for the ordinary tests.
#include "data.hpp"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <vector>

namespace {

namespace files = std::filesystem;

std::vector<files::path> inputs(int count, char** names) {
  std::vector<files::path> found;
  for (int i = 1; i < count; ++i) {
    if (files::is_directory(names[i])) {
      for (const auto& entry : files::directory_iterator(names[i])) {
        found.push_back(entry.path());
      }
    } else {
      found.emplace_back(names[i]);
    }
  }
  std::sort(found.begin(), found.end());
  return found;
}

}  // namespace

int main(int count, char** names) {
  const std::vector<files::path> found = inputs(count, names);
  for (const files::path& path : found) {
    std::ifstream file(path, std::ios::binary);
    const std::vector<char> bytes{std::istreambuf_iterator<char>(file), {}};
    if (!file) {
      std::fprintf(stderr, "%s: cannot be read\n", path.c_str());
      return 1;
    }
    std::fprintf(stderr, "%s, %zu bytes\n", path.c_str(), bytes.size());
    static_cast<void>(
        LLVMFuzzerTestOneInput(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()));
  }
  std::fprintf(stderr, "%zu inputs\n", found.size());
  return found.empty() ? 1 : 0;  // a folder without inputs would test nothing
}
