// SPDX-License-Identifier: Apache-2.0
// InputError: the user's input is wrong. The message names file and field; main() prints it and exits with 2.
// WaveError : waves cannot be written, read or shown as asked for.
#pragma once
#include <stdexcept>
#include <string>

namespace psweep {

class InputError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

class WaveError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace psweep
