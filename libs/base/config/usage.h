// Error messages for a command line that cannot be taken.
#pragma once

#include <string>

namespace CLI {
class App;
class ParseError;
class Validator;
}  // namespace CLI

namespace skein {

// One line for the exception of `app.parse`. If an option is unknown, the line names it and the
// known option of the most similar name, even if CLI11 complains of a missing option: a misspelt
// required option is both.
std::string UsageError(const CLI::App& app, const CLI::ParseError& error);

// For Option::check. The messages of CLI11's own validators show the largest double as upper bound.
CLI::Validator AtLeastZero();
CLI::Validator AboveZero();

}  // namespace skein
