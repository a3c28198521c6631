// What the fuzz targets share. libFuzzer (llvm.org/docs/LibFuzzer.html) calls a target with bytes
// that cover ever more of the code.
#pragma once

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>

#include "core/bytes.h"

namespace skein::fuzz {

using TargetFunction = void (*)(const uint8_t* data, size_t size);

// Before main(). False: the name is taken.
bool AddTarget(const char* name, TargetFunction function);

// Defines the target `name`: a function of `data` and `size`. CMake finds its name here.
#define SKEIN_FUZZ_TARGET(name)                                                        \
  static void Fuzz_##name(const uint8_t* data, size_t size);                           \
  [[maybe_unused]] static const bool name##_is_added = AddTarget(#name, &Fuzz_##name); \
  static void Fuzz_##name(const uint8_t* data, size_t size)

// What must hold for any bytes.
inline void Expect(bool holds, const char* what) {
  if (holds) return;
  std::fprintf(stderr, "does not hold: %s\n", what);
  std::abort();
}

inline Bytes ToBytes(const uint8_t* data, size_t size) { return Bytes(data, data + size); }
inline std::string ToText(const uint8_t* data, size_t size) {
  return std::string(reinterpret_cast<const char*>(data), size);
}

// A folder of this process, in memory, that is removed when the process exits.
class ScratchFolder {
 public:
  ScratchFolder() {
    std::string name = "/dev/shm/skein-fuzz-XXXXXX";
    if (mkdtemp(name.data()) == nullptr) std::abort();
    path_ = name;
  }
  ~ScratchFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  const std::filesystem::path& path() const { return path_; }
  // The file's content becomes these bytes.
  std::filesystem::path Write(const std::string& name, const uint8_t* data, size_t size) const {
    std::FILE* file = std::fopen((path_ / name).c_str(), "wb");
    if (file == nullptr || std::fwrite(data, 1, size, file) != size) std::abort();
    std::fclose(file);
    return path_ / name;
  }

 private:
  std::filesystem::path path_;
};

}  // namespace skein::fuzz
