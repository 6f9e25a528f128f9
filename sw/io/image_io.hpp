// SPDX-License-Identifier: Apache-2.0
// 8-bit images from and to files, by OpenCV imgcodecs.
//   read_gray : PNG, PGM, PPM, TIFF (and what else the installed OpenCV decodes) with 8 bits a channel. Colour becomes
//               grey (0.299 R + 0.587 G + 0.114 B), alpha is dropped. 16-bit, float, empty, truncated and foreign
//               files are refused with an InputError that names the file.
//   write_png : grey or colour (BGR) picture; the same pixels give the same bytes on one machine.
#pragma once
#include <filesystem>
#include <opencv2/core.hpp>

#include "core/image.hpp"

namespace psweep {

Gray read_gray(const std::filesystem::path& path);

void write_png(const std::filesystem::path& path, const cv::Mat& picture);
void write_png(const std::filesystem::path& path, const Gray& picture);

// View of an Image as cv::Mat; no copy, so the Image must outlive it.
inline cv::Mat as_mat(const Gray& image) {
  return cv::Mat(image.height, image.width, CV_8UC1, const_cast<uint8_t*>(image.data.data()));
}
Gray from_mat(const cv::Mat& mat);  // CV_8UC1

// OpenCV reports errors on stderr besides throwing; the command line prints its own message, so it calls this first.
void silence_opencv();

}  // namespace psweep
