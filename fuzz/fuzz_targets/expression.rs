//! See `expression` in `checks.rs`.

#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| checks::expression(data));
