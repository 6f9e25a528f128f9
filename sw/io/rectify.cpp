// SPDX-License-Identifier: Apache-2.0
#include "io/rectify.hpp"

#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include "core/error.hpp"
#include "io/image_io.hpp"

namespace psweep {
namespace {

Gray remapped(const Gray& image, const cv::Mat& k, const cv::Mat& d, const cv::Mat& r, const cv::Mat& p) {
  const cv::Size size(image.width, image.height);
  cv::Mat map_x, map_y, out;
  cv::initUndistortRectifyMap(k, d, r, p, size, CV_32FC1, map_x, map_y);
  cv::remap(as_mat(image), out, map_x, map_y, cv::INTER_LINEAR, cv::BORDER_CONSTANT, cv::Scalar(0));
  return from_mat(out);
}

}  // namespace

RectifiedPair rectify_pair(const Calibration& calibration, const Gray& left, const Gray& right) {
  const RawCameras& raw = *calibration.raw;
  cv::Mat r1, r2, p1, p2, q;
  cv::stereoRectify(raw.k1, raw.d1, raw.k2, raw.d2, cv::Size(left.width, left.height), raw.r, raw.t, r1, r2, p1, p2, q,
                    cv::CALIB_ZERO_DISPARITY, 0);
  RectifiedPair out;
  const auto camera = [](const cv::Mat& p) {
    return Camera{p.at<double>(0, 0), p.at<double>(1, 1), p.at<double>(0, 2), p.at<double>(1, 2)};
  };
  out.rig.left = camera(p1);
  out.rig.right = camera(p2);
  out.rig.baseline = -p2.at<double>(0, 3) / p2.at<double>(0, 0);
  out.rig.width = left.width;
  out.rig.height = left.height;
  if (!(out.rig.baseline > 0) || !(out.rig.left.fx > 0)) {
    throw InputError(calibration.source + ": fields 'R', 'T': OpenCV's stereoRectify finds no rectification for them");
  }
  out.left = remapped(left, raw.k1, raw.d1, r1, p1);
  out.right = remapped(right, raw.k2, raw.d2, r2, p2);
  return out;
}

}  // namespace psweep
