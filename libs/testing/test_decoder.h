// For tests: decoders of photos that fail. A test that includes this depends on the target
// faulty_decoder and defines SKEIN_BINARY_DIR, as skein_test does.
#pragma once

#include <filesystem>
#include <string>

#include "photo/photo_decoder.h"
#include "testing/test_folder.h"

namespace skein {

// A program that fails in the way that its name says (faulty_decoder_main.cc).
class FaultyDecoder {
 public:
  explicit FaultyDecoder(const std::string& how) {
    std::filesystem::create_symlink(std::filesystem::path(SKEIN_BINARY_DIR) / "bin/faulty_decoder",
                                    folder_ / how);
    options.program = (folder_ / how).string();
    options.bounds = {1, 2};
  }
  DecoderOptions options;

 private:
  TestFolder folder_;
};

}  // namespace skein
