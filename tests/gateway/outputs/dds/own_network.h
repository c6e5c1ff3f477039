// Two machines of the test's own, with loopback and a cable between them that can be taken away:
// for what depends on the interfaces of a machine. Fast DDS has its threads where it is called.
// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace baudgate::dds::testing {

class OwnNetwork {
 public:
  /// The addresses of the interface here and of that on the other machine.
  static constexpr char kHere[] = "10.77.0.5";
  static constexpr char kThere[] = "10.77.0.9";

  /// The calling thread is here from now on, and those that it starts.
  OwnNetwork();
  ~OwnNetwork();  ///< back to where it was
  OwnNetwork(const OwnNetwork&) = delete;
  OwnNetwork& operator=(const OwnNetwork&) = delete;

  /// False: this user may not make networks; root may.
  bool ok() const { return there_ >= 0; }
  void GoThere() const;
  void ComeBack() const;

  /// With both interfaces.
  void AddCable() const;
  void RemoveCable() const;
  /// The other end goes down and up.
  void Unplug() const;
  void PlugIn() const;

 private:
  int before_ = -1;
  int here_ = -1;
  int there_ = -1;
};

}  // namespace baudgate::dds::testing
