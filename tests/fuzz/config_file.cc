// The file of all services' options.
#include "config/config_file.h"

#include "fuzz/fuzz.h"

namespace skein::fuzz {

SKEIN_FUZZ_TARGET(config_file) { ParseConfigFile(ToText(data, size), "file").ok(); }

}  // namespace skein::fuzz
