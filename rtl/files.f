# Compile order, relative to this folder.
psweep_pkg.vhd
ram_sdp.vhd
stream_reg.vhd
control.vhd
address_generator.vhd
storage.vhd
interpolation.vhd
