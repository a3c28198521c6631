// A list of checksums.
#include "core/checksum_list.h"

#include "fuzz/fuzz.h"

using namespace skein;

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  static const fuzz::ScratchFolder folder;
  folder.Write("a", reinterpret_cast<const uint8_t*>("x"), 1);
  folder.Write("list", data, size);
  CheckChecksumList(folder.path(), "list").ok();
  return 0;
}
