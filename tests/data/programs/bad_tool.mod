MODULE utf8
  ! Größe, 位置, naïve
  CONST robtarget p1:=[[818.7,147.3,858.2],[0,-0.97969618,0,0.20048792],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    TPWrite "Über; MoveL p1,v1,fine,tGripper;";
    movel   p1 , v100 , fine , tGripper ;MoveL p1,v50,fine,tGripper;
  ENDPROC
ENDMODULE
