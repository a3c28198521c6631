#pragma once

#include <string>

namespace CLI {
class App;
}

namespace skein {

// "" unless an option that takes numbers with a fraction was given what is none, as nan or inf:
// then one line. CLI11 reads these, and a comparison with a bound does not find the first.
std::string NotFinite(const CLI::App& app);

}  // namespace skein
