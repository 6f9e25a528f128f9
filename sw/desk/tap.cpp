// SPDX-License-Identifier: Apache-2.0
#include "desk/tap.hpp"

#include <fcntl.h>
#include <linux/if.h>
#include <linux/if_tun.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "core/error.hpp"

namespace psweep::chip {

Tap::Tap(const std::string& device) {
  if (device.empty() || device.size() >= IFNAMSIZ)
    throw InputError("--tap: found '" + device + "', expected the name of a device, 1 .. " +
                     std::to_string(IFNAMSIZ - 1) + " characters");
  fd_ = ::open("/dev/net/tun", O_RDWR | O_NONBLOCK | O_CLOEXEC);
  if (fd_ < 0) {
    const std::string why = std::strerror(errno);
    const bool rights = errno == EACCES || errno == EPERM;
    throw InputError("--tap: /dev/net/tun: " + why +
                     (rights ? "; needs read and write permission on it (root, or a group that has it)"
                             : "; the kernel module is not there: modprobe tun"));
  }
  ifreq request{};
  std::memcpy(request.ifr_name, device.c_str(), device.size());
  request.ifr_flags = IFF_TAP | IFF_NO_PI;
  if (::ioctl(fd_, TUNSETIFF, &request) < 0) {
    const int error = errno;
    ::close(fd_);
    std::string hint;
    if (error == EPERM)
      hint =
          "; needs CAP_NET_ADMIN, or a device made for you: sudo ip tuntap add dev " + device + " mode tap user $USER";
    if (error == EBUSY) hint = "; another program has it open";
    if (error == EINVAL) hint = "; there is a device of this name that is no TAP device";
    throw InputError("--tap: " + device + ": " + std::strerror(error) + hint);
  }
}

Tap::~Tap() { ::close(fd_); }

std::optional<net::Bytes> Tap::read() {
  net::Bytes frame(2048);
  const ssize_t size = ::read(fd_, frame.data(), frame.size());
  if (size <= 0) return std::nullopt;
  frame.resize(static_cast<size_t>(size));
  return frame;
}

bool Tap::write(const net::Bytes& frame) {
  return ::write(fd_, frame.data(), frame.size()) == static_cast<ssize_t>(frame.size());
}

}  // namespace psweep::chip
