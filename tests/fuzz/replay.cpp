// <target>_replay SECONDS FOLDER...: what libFuzzer does, for compilers without it. Runs the target on every
// file of the folders, then on files with random changes until the time is up; the same changes each time.
// What stops it is left beside it in `crash`.

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <string>
#include <vector>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace {

using Bytes = std::vector<std::uint8_t>;

constexpr std::size_t longest = 4096;

Bytes content(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return Bytes(std::istreambuf_iterator<char>(file), {});
}

class Mutator {
 public:
  explicit Mutator(const std::vector<Bytes>& seeds) : seeds_(seeds) {}

  // A seed with up to eight changes: bytes set, removed, doubled, or taken from another seed.
  Bytes next() {
    Bytes bytes = seeds_[below(seeds_.size())];
    for (std::size_t change = 1 + below(8); change > 0; --change) {
      const std::size_t at = below(bytes.size() + 1), rest = bytes.size() - at;
      const std::size_t length = std::min<std::size_t>(rest, 1 + below(8));
      const auto place = bytes.begin() + static_cast<std::ptrdiff_t>(at);
      switch (below(4)) {
        case 0:
          if (rest > 0) bytes[at] = static_cast<std::uint8_t>(draw_());
          break;
        case 1:
          bytes.erase(place, place + static_cast<std::ptrdiff_t>(length));
          break;
        case 2: {
          const Bytes part(place, place + static_cast<std::ptrdiff_t>(length));
          bytes.insert(place, part.begin(), part.end());
          break;
        }
        default: {
          const Bytes& other = seeds_[below(seeds_.size())];
          const std::size_t first = below(other.size() + 1), count = below(other.size() - first + 1);
          const auto from = other.begin() + static_cast<std::ptrdiff_t>(first);
          bytes.insert(place, from, from + static_cast<std::ptrdiff_t>(std::min<std::size_t>(count, 64)));
        }
      }
    }
    if (bytes.size() > longest) bytes.resize(longest);
    return bytes;
  }

 private:
  std::size_t below(std::size_t bound) { return bound == 0 ? 0 : draw_() % bound; }
  const std::vector<Bytes>& seeds_;
  std::mt19937 draw_{20240229};
};

void run(const Bytes& bytes) { LLVMFuzzerTestOneInput(bytes.data(), bytes.size()); }

}  // namespace

int main(int count, char** arguments) {
  namespace fs = std::filesystem;
  if (count < 3) return 2;
  std::vector<Bytes> seeds;
  for (int i = 2; i < count; ++i)
    for (const auto& entry : fs::directory_iterator(arguments[i]))
      if (entry.is_regular_file()) seeds.push_back(content(entry.path()));
  if (seeds.empty()) return 2;
  for (const Bytes& seed : seeds) run(seed);

  using Clock = std::chrono::steady_clock;
  const auto end = Clock::now() + std::chrono::duration<double>(std::atof(arguments[1]));
  Mutator mutator(seeds);
  long tried = 0;
  for (; Clock::now() < end; ++tried) {
    const Bytes bytes = mutator.next();
    std::ofstream("crash", std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    run(bytes);
  }
  fs::remove("crash");
  std::printf("%zu files and %ld changed ones\n", seeds.size(), tried);
  return 0;
}
