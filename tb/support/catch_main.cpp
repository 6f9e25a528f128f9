// SPDX-License-Identifier: Apache-2.0
// Catch2 2 needs one translation unit with its main; Catch2 3 brings a library.
#define CATCH_CONFIG_MAIN
#include <catch2/catch.hpp>
