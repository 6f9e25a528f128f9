psweep_pkg.vhd
ram_sdp.vhd
stream_reg.vhd
