// SPDX-License-Identifier: Apache-2.0
// Wave<Dut>: the FST file of one Verilated model. A model that was built without waves (RtlModel.cmake, TRACE) refuses
// to open one and costs nothing. Class Dut is a parameter because models of both kinds meet in one program.
//
//   Wave<Dut>::prepare(context);   // before the model's first clock, if the file is opened later than that
//   wave.open(dut, file);          // throws WaveError
//   wave.dump(time);               // nothing while it is closed; times ascend
#pragma once
#include <verilated.h>
#if VM_TRACE
#include <verilated_fst_c.h>
#endif
#include <cstdint>
#include <memory>
#include <string>

#include "core/error.hpp"

namespace psweep::simulator {

template <class Dut>
class Wave {
 public:
#if VM_TRACE
  static constexpr bool kBuiltIn = true;
#else
  static constexpr bool kBuiltIn = false;
#endif

  // From here on the model computes signals that nothing but the waves looks at.
  static void prepare([[maybe_unused]] VerilatedContext& context) {
    if constexpr (kBuiltIn) context.traceEverOn(true);
  }
  void open([[maybe_unused]] Dut& dut, [[maybe_unused]] const std::string& file) {
#if VM_TRACE
    prepare(*dut.contextp());
    file_ = std::make_unique<VerilatedFstC>();
    dut.trace(file_.get(), 99);
    file_->open(file.c_str());
    if (!file_->isOpen()) throw WaveError(file + ": cannot be written");
#else
    throw WaveError("this configuration was built without waves (\"waves\" in its JSON file)");
#endif
  }
  void dump([[maybe_unused]] uint64_t time) {
#if VM_TRACE
    if (file_) file_->dump(time);
#endif
  }
  void close() {
#if VM_TRACE
    if (file_) file_->close();
    file_.reset();
#endif
  }
#if VM_TRACE
  bool is_open() const { return file_ != nullptr; }

 private:
  std::unique_ptr<VerilatedFstC> file_;
#else
  bool is_open() const { return false; }
#endif
};

}  // namespace psweep::simulator
