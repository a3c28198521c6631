// Error messages for a command line that cannot be taken.
#pragma once

#include <string>

namespace CLI {
class App;
class ParseError;
class Validator;
}  // namespace CLI

namespace skein {

// One line, for what `app.parse` threw. An unknown option goes first, with the known one of a
// similar name: with a misspelt name, the required option is missing, too.
std::string UsageError(const CLI::App& app, const CLI::ParseError& error);

// For Option::check. CLI11's own tell the largest double as the other bound.
CLI::Validator AtLeastZero();
CLI::Validator AboveZero();

}  // namespace skein
