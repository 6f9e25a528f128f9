// SPDX-License-Identifier: Apache-2.0
// main() of every test program with Catch2 2; version 3 brings its own as a library.
#define CATCH_CONFIG_MAIN
#include <catch2/catch.hpp>
