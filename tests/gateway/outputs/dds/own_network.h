// Two virtual machines (network namespaces) with a removable cable between them. The threads of
// Fast DDS run in the network of the thread that starts them.
// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace baudgate::dds::testing {

class OwnNetwork {
 public:
  static constexpr char kHere[] = "10.77.0.5";
  static constexpr char kThere[] = "10.77.0.9";

  /// Moves the calling thread, and all threads that it starts, into the network of kHere.
  OwnNetwork();
  ~OwnNetwork();
  OwnNetwork(const OwnNetwork&) = delete;
  OwnNetwork& operator=(const OwnNetwork&) = delete;

  /// Returns false if this user is not allowed to create network namespaces. Root is allowed to.
  bool ok() const { return there_ >= 0; }
  void GoThere() const;
  void ComeBack() const;

  void AddCable() const;
  void RemoveCable() const;
  void Unplug() const;
  void PlugIn() const;

 private:
  int before_ = -1;
  int here_ = -1;
  int there_ = -1;
};

}  // namespace baudgate::dds::testing
