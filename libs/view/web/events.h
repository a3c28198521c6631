// The ledger as the page of the live view reads it: one JSON object a fact. services/web/README.md
// lists the fields of each kind.
#pragma once

#include <string>

#include "ledger/facts.h"

namespace skein {

// "" for facts that are no events: leases and configurations. Numbers are rounded to what a picture
// needs: positions and rotations to 7 digits, the rest to 4.
std::string EventOf(const Fact& fact);

// The value with that many significant digits.
double Rounded(double value, int digits);

}  // namespace skein
