// SPDX-License-Identifier: Apache-2.0
// Calibration files, told apart by their content (docs/file_formats.md):
//   kPsweep      YAML of this project: width, height, baseline, row_offset, left/right { fx fy cx cy }
//   kProjection  P1 and P2, as OpenCV's stereoRectify returns them
//   kReprojection  Q of stereoRectify
//   kMiddlebury  calib.txt: cam0, cam1, doffs, baseline (mm), width, height, ndisp
//   kRaw         K, D of both cameras, R, T: the images must be rectified first (io/rectify.hpp)
// YAML, XML and JSON of OpenCV's FileStorage are read; the "%YAML:1.0" line may be missing.
// Every error is an InputError "file: field 'name': found .., expected ..".
#pragma once
#include <filesystem>
#include <opencv2/core.hpp>
#include <optional>
#include <string>

#include "core/planes.hpp"
#include "core/rig.hpp"

namespace psweep {

enum class CalibrationKind { kPsweep, kProjection, kReprojection, kMiddlebury, kRaw, kDisparityRange };
const char* to_string(CalibrationKind kind);

// Cameras before rectification, in OpenCV's terms; t in metres.
struct RawCameras {
  cv::Mat k1, d1, k2, d2, r, t;  // CV_64F: 3x3, 1xN, 3x3, 1xN, 3x3, 3x1
};

// Total disparities x_left - x_right + doffs, in pixels, that a calibration or an option asks to search.
struct DisparityRange {
  double lo = 0, hi = 0;  // 0 < lo < hi
};

struct Calibration {
  CalibrationKind kind = CalibrationKind::kPsweep;
  std::string source;             // file name, for messages
  Rig rig;                        // width = height = 0 where the file does not say; not set for kRaw
  std::optional<RawCameras> raw;  // kRaw only
  std::optional<DisparityRange> search;
  bool metric = true;  // false: depths are relative only (kDisparityRange)
};

// What to do with a file that holds both raw cameras and P1/P2 (or Q).
enum class Rectify { kAuto, kYes, kNo };

Calibration read_calibration(const std::filesystem::path& path, Rectify rectify = Rectify::kAuto);

// The project's own YAML; parses back to the same rig, bit for bit.
std::string calibration_yaml(const Rig& rig);
void write_calibration(const std::filesystem::path& path, const Rig& rig);

// Rectified pair without calibration: focal length = image width, baseline 0.1 m, so depths are relative, but
// disparities are right. lo .. hi: disparities in pixels, lo > 0 (planes are spaced exponentially).
Calibration disparity_range_calibration(double lo, double hi, int width, int height);

// Planes that cover a disparity range: zmin = f b / hi, zmax = f b / lo, neighbours at most `step` pixels apart.
PlaneSpacing planes_for(const Rig& rig, const DisparityRange& range, double step = 0.75);

// Takes the size from the images where the calibration has none, and refuses a contradiction.
void adopt_size(Calibration& calibration, const std::string& image_name, int width, int height);

}  // namespace psweep
