// A list of checksums.
#include "core/checksum_list.h"

#include "fuzz/fuzz.h"

namespace skein::fuzz {

SKEIN_FUZZ_TARGET(checksum_list) {
  static const ScratchFolder folder;
  folder.Write("a", reinterpret_cast<const uint8_t*>("x"), 1);
  folder.Write("list", data, size);
  CheckChecksumList(folder.path(), "list").ok();
}

}  // namespace skein::fuzz
