#include "config/usage.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

namespace skein {
namespace {

// Levenshtein's distance: how many letters are put in, left out or changed.
size_t EditDistance(const std::string& a, const std::string& b) {
  std::vector<size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), size_t{0});
  for (size_t i = 0; i < a.size(); ++i) {
    size_t diagonal = row[0];
    row[0] = i + 1;
    for (size_t k = 0; k < b.size(); ++k) {
      const size_t changed = diagonal + (a[i] == b[k] ? 0 : 1);
      diagonal = row[k + 1];
      row[k + 1] = std::min({changed, row[k] + 1, diagonal + 1});
    }
  }
  return row.back();
}

// Similar: the beginning of a known name, or up to a third of its letters wrong, as in a slip of
// the keyboard; beyond that, short names resemble each other by chance. "" if none is.
std::string SimilarOption(const CLI::App& app, const std::string& unknown) {
  std::string best;
  size_t best_distance = 0;
  for (const CLI::Option* option : app.get_options()) {
    for (const std::string& name : option->get_lnames()) {
      const size_t distance = name.rfind(unknown, 0) == 0 ? 1 : EditDistance(unknown, name);
      if (distance > (name.size() + 2) / 3 || (!best.empty() && distance >= best_distance))
        continue;
      best = name;
      best_distance = distance;
    }
  }
  return best;
}

// A predicate over doubles, with what to give.
CLI::Validator NumberThat(bool (*is_good)(double), const std::string& wanted,
                          const std::string& type) {
  return CLI::Validator(
      [is_good, wanted](std::string& text) {
        double value = 0;
        const bool is_number = CLI::detail::lexical_cast(text, value);
        return is_number && std::isfinite(value) && is_good(value)
                   ? std::string()
                   : "give " + wanted + ", not '" + text + "'";
      },
      type);
}

}  // namespace

std::string UsageError(const CLI::App& app, const CLI::ParseError& error) {
  for (const std::string& word : app.remaining()) {
    if (word.size() < 2 || word[0] != '-') continue;
    const std::string name = word.substr(0, word.find('='));
    const std::string similar = SimilarOption(app, name.substr(name.find_first_not_of('-')));
    return "there is no option " + name +
           (similar.empty() ? "" : "; do you mean --" + similar + "?");
  }
  return error.what();
}

CLI::Validator AtLeastZero() {
  return NumberThat([](double value) { return value >= 0; }, "0 or more", "NONNEGATIVE");
}

CLI::Validator AboveZero() {
  return NumberThat([](double value) { return value > 0; }, "more than 0", "POSITIVE");
}

}  // namespace skein
