// Two virtual machines (network namespaces) with a removable cable between them. The threads of
// Fast DDS run in the network of the thread that starts them.
// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace baudgate::dds::testing {

class OwnNetwork {
 public:
  /// The address here, and the address on the other machine.
  static constexpr char kHere[] = "10.77.0.5";
  static constexpr char kThere[] = "10.77.0.9";

  /// Moves the calling thread, and all that it starts, into the network "here".
  OwnNetwork();
  ~OwnNetwork();  ///< moves the thread back
  OwnNetwork(const OwnNetwork&) = delete;
  OwnNetwork& operator=(const OwnNetwork&) = delete;

  /// False if this user may not make networks. Root may.
  bool ok() const { return there_ >= 0; }
  void GoThere() const;
  void ComeBack() const;

  void AddCable() const;
  void RemoveCable() const;
  /// Takes the other end of the cable down; PlugIn brings it up again.
  void Unplug() const;
  void PlugIn() const;

 private:
  int before_ = -1;
  int here_ = -1;
  int there_ = -1;
};

}  // namespace baudgate::dds::testing
