#include "core/json_depth.h"

namespace skein {

bool IsShallowJson(const Bytes& text, int max_depth) {
  int depth = 0;
  bool in_string = false;
  for (size_t i = 0; i < text.size(); ++i) {
    const uint8_t c = text[i];
    if (in_string) {
      if (c == '\\') ++i;
      if (c == '"') in_string = false;
      continue;
    }
    if (c == '"') in_string = true;
    if ((c == '[' || c == '{') && ++depth > max_depth) return false;
    if (c == ']' || c == '}') --depth;
  }
  return true;
}

}  // namespace skein
