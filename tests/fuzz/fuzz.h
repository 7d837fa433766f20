#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

namespace imprint {

/// What is fuzzed: inputs that are good to begin with, and the code that takes any. An input that crashes it, throws
/// out of it or keeps it for more than 10 s is a finding.
struct FuzzTarget {
  std::string name;
  std::vector<std::string> seeds;
  std::function<void(std::span<const std::uint8_t>)> take;
};

/// Mutates the seeds for the time given on the command line (`--seconds S`, `--seed N`), or takes the files given once
/// (to repeat a finding). A finding is written to `finding-<name>` in the working folder before the process ends by it.
int fuzz(const FuzzTarget& target, int argc, char** argv);

}  // namespace imprint
